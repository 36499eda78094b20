"""`python -m experiments.studies.trace`: traces campaigns whose truth is known, and scores the answers."""

import argparse
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from workbench.base.errors import InputError
from workbench.cli import script
from workbench.commands.common.options import computes, finish, jobs, works

from .given import given

_RIGS = ("jack-10t", "pump-rig", "second-order")
_PLATFORMS, _JOINTS = "platforms", "joints"


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "--campaigns", type=Path, metavar="DIR", help="folder of campaigns with a truth.json beside them"
    )
    parser.add_argument("--rig", default=_RIGS[0], help=f"draw on {' or '.join(_RIGS)} (default: {_RIGS[0]})")
    parser.add_argument("--number", type=int, default=100, metavar="N", help="campaigns to draw (default: 100)")
    parser.add_argument("--seed", type=int, default=0, help="seed of what is drawn (default: 0)")
    parser.add_argument(
        "--kind",
        help="the one kind of campaigns to draw: clean, single, pair, number, off, neighbours, platforms, joints",
    )
    parser.add_argument("--several", action="store_true", help="trace with --several")
    parser.add_argument(
        "--names", action="store_true", help="learn no shapes, which take most of the time and change no name"
    )
    works(parser)
    parser.add_argument("--keep", type=Path, metavar="DIR", help="folder for the drawn campaigns")
    computes(parser, _trace_study, rig=False)


def _trace_study(options: argparse.Namespace, words: list[str]) -> None:
    for name, least in (("number", 1), ("seed", 0)):
        value = getattr(options, name)
        if value < least:
            raise InputError(f"--{name} {value}: must be {least} or more")
    if options.rig not in _RIGS:
        raise InputError(f"--rig {options.rig}: campaigns are drawn on {' or '.join(_RIGS)}")
    if options.several and options.kind == _JOINTS:
        raise InputError("--several is for effects in legs; of joints and payload up to three are always looked for")
    if options.names and options.kind in (_PLATFORMS, _JOINTS):
        raise InputError("--names is for campaigns of one jack; leave it out")
    if options.campaigns and options.kind:
        raise InputError("--kind is for campaigns that are drawn; leave out --kind or --campaigns")
    folder = options.campaigns and options.campaigns.resolve()  # workers have working folders of their own
    campaigns = given(folder) if folder else []
    from workbench.commands.trace.platform import traced_balance, traced_platform
    from workbench.commands.trace.study import traced

    from .joints import joint_draws
    from .plan import default_plan
    from .platforms import platform_draws
    from .study import identity, run_trace_study

    draws: dict[str | None, Callable[[int, int], list[Any]]] = {_PLATFORMS: platform_draws, _JOINTS: joint_draws}
    plan = campaigns or (
        draws[options.kind](options.number, options.seed)
        if options.kind in draws
        else default_plan(options.number, options.seed, options.rig, options.kind)
    )
    platform = traced_balance if options.kind == _JOINTS else traced_platform
    trace = platform if options.kind in draws else traced
    keep = options.keep and options.keep.resolve()
    if keep:
        keep.mkdir(parents=True, exist_ok=True)
    name = f"trace-study-{folder.name}" if folder else "trace-study"
    asked = {**({"several": True} if options.several else {}), **({"learns": False} if options.names else {})}
    tracer = partial(trace, **asked) if asked else trace
    study = partial(run_trace_study, plan, tracer, jobs=jobs(options), keep=keep)
    command = {"command": "trace-study", "items": identity(plan), "several": options.several}
    command |= {"names": True} if options.names else {}
    finish(options, words, name, command, study)


def main(words: Sequence[str] | None = None) -> int:
    """Run it; 2 where it is asked for what cannot be."""
    return script("experiments.studies.trace", "Measure how often a trace is right.", options, words)


if __name__ == "__main__":
    sys.exit(main())
