"""`python -m experiments.studies.watch`: its arguments."""

import argparse
import sys
from collections.abc import Sequence
from functools import partial

from workbench.base.errors import InputError
from workbench.cli import script
from workbench.commands.common.options import computes, finish_in_folder, jobs, works
from workbench.commands.common.shipped import experiment

_LEAST = {"number": 1, "first": 0, "sessions": 12, "years": 1, "seed": 0}


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("--number", type=int, default=12, metavar="N", help="rigs to watch (default: 12)")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first rig (default: 0)")
    parser.add_argument(
        "--sessions", type=int, default=30, metavar="T", help="sessions of each rig, a week apart (default: 30)"
    )
    parser.add_argument(
        "--years", type=int, default=200, metavar="Y", help="years of healthy rigs to draw (default: 200)"
    )
    parser.add_argument("--mend", action="store_true", help="mend every worn rig after two thirds of its wear")
    parser.add_argument(
        "--unsteady",
        action="store_true",
        help="supplies wander by up to 2 %%, half of the rigs have no oil temperature, and one wear has no name",
    )
    parser.add_argument("--two", action="store_true", help="two wears on every worn rig, each from its own session on")
    parser.add_argument("--seed", type=int, default=0, help="seed of what is drawn (default: 0)")
    works(parser)
    computes(parser, _watch_study, rig=False)


def _watch_study(options: argparse.Namespace, words: list[str]) -> None:
    for name, least in _LEAST.items():
        value = getattr(options, name)
        if value < least:
            raise InputError(f"--{name} {value}: must be {least} or more")
    from workbench.commands.watch.options import loop_of

    from .made_rig import drawn_rigs
    from .study import run_watch_study

    drawn = options.first + options.number, options.seed, options.sessions, options.mend, options.unsteady, options.two
    rigs = drawn_rigs(*drawn)[options.first :]
    loop = loop_of(experiment("position_tuned"), "p-dp")
    identity = {"command": "watch-study", "rigs": [str(rig) for rig in rigs], "years": options.years}
    study = partial(run_watch_study, rigs, loop, options.years, jobs=jobs(options))
    finish_in_folder(options, words, "watch-study", identity, study)


def main(words: Sequence[str] | None = None) -> int:
    """Run it; 2 where it is asked for what cannot be."""
    return script("experiments.studies.watch", "Measure how well rigs are watched over months.", options, words)


if __name__ == "__main__":
    sys.exit(main())
