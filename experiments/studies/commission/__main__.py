"""`python -m experiments.studies.commission`: its arguments."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial

from workbench.base.errors import InputError
from workbench.cli import script
from workbench.commands.common.options import computes, finish_in_folder, jobs, works
from workbench.rigs.rig_file import load_rig

from . import RIG


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    rigs = "jack-10t with what its datasheet lacks, or other benches, limits, channels and periods (default: hidden)"
    parser.add_argument("--rigs", choices=("hidden", "others"), default="hidden", help=rigs)
    parser.add_argument("--number", type=int, default=20, metavar="N", help="rigs to commission (default: 20)")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first rig (default: 0)")
    parser.add_argument("--seed", type=int, default=0, help="seed of what is drawn (default: 0)")
    works(parser)
    computes(parser, _commission_study, rig=False)


def _commission_study(options: argparse.Namespace, words: list[str]) -> None:
    for name, least in (("number", 1), ("first", 0), ("seed", 0)):
        value = getattr(options, name)
        if value < least:
            raise InputError(f"--{name} {value}: must be {least} or more")
    from .plan import hidden_plan, other_plan
    from .study import run_commission_study

    drawn = other_plan if options.rigs == "others" else partial(hidden_plan, load_rig(RIG))
    plans = [drawn(number, options.seed) for number in range(options.first, options.first + options.number)]
    identity = {"command": "commission-study", "plans": [asdict(plan) for plan in plans]}
    study = partial(run_commission_study, plans, jobs=jobs(options))
    finish_in_folder(options, words, "commission-study", identity, study)


def main(words: Sequence[str] | None = None) -> int:
    """Run it; 2 where it is asked for what cannot be."""
    return script("experiments.studies.commission", "Measure how well hidden rigs are commissioned.", options, words)


if __name__ == "__main__":
    sys.exit(main())
