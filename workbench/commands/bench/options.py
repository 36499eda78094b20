"""`jackbench bench EXPERIMENT`: every controller on every rig of a set in every scenario."""

import argparse
from pathlib import Path

from ..common.bench_experiment import load_bench
from ..common.experiment import data_files
from ..common.options import computes, finish, jobs, works
from ..common.outcome import Outcome, Progress, Stage
from ..common.shipped import experiment


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a bench experiment, such as experiments/benchmark.toml")
    works(parser)
    computes(parser, _bench)


def _bench(options: argparse.Namespace, words: list[str]) -> None:
    config = load_bench(options.experiment, options.rig)
    from .study import beside_automatic, run_bench

    identity = {"command": "bench", "experiment": config.source, "rig": config.rig.table()}
    if files := data_files(config.source):
        identity["files"] = files

    def study(stage: Stage, progress: Progress) -> Outcome:
        return run_bench(beside_automatic(config, progress), stage, progress, jobs(options))

    finish(options, words, Path(options.experiment).stem, identity, study)
