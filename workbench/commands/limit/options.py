"""`jackbench limit EXPERIMENT`: its arguments."""

import argparse
from functools import partial

from ...base.errors import InputError
from ...base.units import quantity
from ..common.bench_experiment import BenchConfig
from ..common.declared import finish_experiment, load_one
from ..common.options import computes, jobs, works
from ..common.shipped import experiment
from ..common.step_experiment import StepConfig


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
    margin = _margin(options.margin)
    config = load_one((StepConfig, BenchConfig), options.experiment, options.rig)
    from .study import run_limit

    study = partial(run_limit, config, margin, jobs=jobs(options))
    finish_experiment(options, words, "limit", config, study, "limit-", margin=margin)


def _margin(text: str) -> float:
    """In Pa. Raises InputError."""
    try:
        margin = quantity(text, "Pa")
    except InputError as error:
        raise InputError(f"--margin {text}: {error}") from None
    if not 0 <= margin < float("inf"):
        raise InputError(f"--margin {text}: must be 0 bar or more")
    return margin
