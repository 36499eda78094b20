"""`jackbench limit EXPERIMENT`: its arguments."""

import argparse
from functools import partial
from pathlib import Path

from ...base.errors import InputError
from ...base.toml import read_toml
from ...base.units import quantity
from ..common.bench_experiment import load_bench
from ..common.options import computes, finish, jobs, works
from ..common.shipped import experiment
from ..common.step_experiment import load_steps


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "experiment", type=experiment, help="a step or bench experiment, such as experiments/benchmark.toml"
    )
    parser.add_argument(
        "--margin",
        default="0 bar",
        metavar="PRESSURE",
        help="least pressure of every chamber above the vapour's, 0 bar absolute (default: 0 bar)",
    )
    works(parser)
    computes(parser, _limit)


def _limit(options: argparse.Namespace, words: list[str]) -> None:
    path = Path(options.experiment)
    margin = _margin(options.margin)
    load = load_bench if read_toml(path).values.get("experiment") == "bench" else load_steps
    config = load(path, options.rig)
    from .study import run_limit

    identity = {"command": "limit", "experiment": config.source, "rig": config.rig.table(), "margin": margin}
    finish(options, words, f"limit-{path.stem}", identity, partial(run_limit, config, margin, jobs=jobs(options)))


def _margin(text: str) -> float:
    """In Pa. Raises InputError."""
    try:
        margin = quantity(text, "Pa")
    except InputError as error:
        raise InputError(f"--margin {text}: {error}") from None
    if not 0 <= margin < float("inf"):
        raise InputError(f"--margin {text}: must be 0 bar or more")
    return margin
