"""`jackbench limit EXPERIMENT`: its arguments."""

import argparse
from functools import partial

from ...base.units import Spec
from ..common.bench_experiment import BenchConfig
from ..common.declared import finish_experiment, load_one
from ..common.options import computes, jobs, measured, works
from ..common.shipped import experiment
from ..common.step_experiment import StepConfig

_MARGIN = Spec("Pa", 0.0, 1e9, "least pressure of every chamber above 1 atm")


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "experiment", type=experiment, help="a step or bench experiment, such as experiments/benchmark.toml"
    )
    measured(parser, "--margin", _MARGIN, f"{_MARGIN.meaning}, where gas comes out (default: 0 bar)", "PRESSURE")
    works(parser)
    computes(parser, _limit)


def _limit(options: argparse.Namespace, words: list[str]) -> None:
    margin = options.margin or 0.0
    config = load_one((StepConfig, BenchConfig), options.experiment, options.rig)
    from .study import run_limit

    study = partial(run_limit, config, margin, jobs=jobs(options))
    finish_experiment(options, words, "limit", config, study, "limit-", margin=margin)
