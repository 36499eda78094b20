"""`jackbench time EXPERIMENT`: times its controllers and leaves timed.toml with their computing delays."""

import argparse
from functools import partial

from ..common.bench_experiment import BenchConfig
from ..common.declared import finish_experiment, load_one
from ..common.options import computes
from ..common.shipped import experiment
from ..common.step_experiment import StepConfig


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "experiment", type=experiment, help="a step or bench experiment, such as experiments/benchmark.toml"
    )
    computes(parser, _time)


def _time(options: argparse.Namespace, words: list[str]) -> None:
    config = load_one((StepConfig, BenchConfig), options.experiment, options.rig)
    from .study import run_timing

    study = partial(run_timing, config, options.rig or config.source.get("rig", ""))
    finish_experiment(options, words, "time", config, study, "time-")
