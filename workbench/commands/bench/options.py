"""`jackbench bench EXPERIMENT`: every controller on every rig of a set in every scenario."""

import argparse

from ..common.bench_experiment import BenchConfig
from ..common.declared import takes_experiment


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    what = "a bench experiment, such as experiments/benchmark.toml"
    takes_experiment(parser, what, BenchConfig, "bench.study:run_whole_bench", shared=True)
