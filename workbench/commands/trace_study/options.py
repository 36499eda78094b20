"""`jackbench trace-study`: traces campaigns whose truth is known, and scores the answers."""

import argparse
from functools import partial
from pathlib import Path

from ...base.errors import InputError
from ..common.options import computes, finish, jobs, works
from .given import given


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("--campaigns", type=Path, metavar="DIR", help="folders with a truth.json beside them")
    parser.add_argument("--number", type=int, default=100, metavar="N", help="campaigns to draw (default: 100)")
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn (default: 0)")
    works(parser)
    parser.add_argument("--keep", type=Path, metavar="DIR", help="leave the drawn campaigns there")
    computes(parser, _trace_study, rig=False)


def _trace_study(options: argparse.Namespace, words: list[str]) -> None:
    for name, least in (("number", 1), ("seed", 0)):
        value = getattr(options, name)
        if value < least:
            raise InputError(f"--{name} {value}: must be {least} or more")
    folder = options.campaigns and options.campaigns.resolve()  # workers have working folders of their own
    campaigns = given(folder) if folder else []
    from ..trace.study import traced
    from .study import default_plan, identity, run_trace_study

    plan = campaigns or default_plan(options.number, options.seed)
    keep = options.keep and options.keep.resolve()
    if keep:
        keep.mkdir(parents=True, exist_ok=True)
    name = f"trace-study-{folder.name}" if folder else "trace-study"
    study = partial(run_trace_study, plan, traced, jobs=jobs(options), keep=keep)
    finish(options, words, name, {"command": "trace-study", "items": identity(plan)}, study)
