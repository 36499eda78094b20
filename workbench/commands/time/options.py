"""`jackbench time EXPERIMENT`: times its controllers and leaves timed.toml with their computing delays."""

import argparse
from functools import partial
from pathlib import Path

from ...base.toml import read_toml
from ..common.bench_experiment import load_bench
from ..common.options import computes, finish
from ..common.shipped import experiment
from ..common.step_experiment import load_steps


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "experiment", type=experiment, help="a step or bench experiment, such as experiments/benchmark.toml"
    )
    computes(parser, _time)


def _time(options: argparse.Namespace, words: list[str]) -> None:
    path = Path(options.experiment)
    load = load_bench if read_toml(path).values.get("experiment") == "bench" else load_steps
    config = load(path, options.rig)
    from .study import run_timing

    identity = {"command": "time", "experiment": config.source, "rig": config.rig.table()}
    study = partial(run_timing, config, options.rig or config.source.get("rig", ""))
    finish(options, words, f"time-{path.stem}", identity, study)
