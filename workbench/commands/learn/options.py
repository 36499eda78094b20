"""`jackbench learn EXPERIMENT`: its arguments."""

import argparse
from functools import partial
from pathlib import Path

from ...rigs.rig import rig_table
from ..common.experiment import data_files
from ..common.options import computes, finish
from ..common.shipped import experiment
from .config import load_learning


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="such as experiments/learn_sine.toml")
    computes(parser, _learn)


def _learn(options: argparse.Namespace, words: list[str]) -> None:
    config = load_learning(options.experiment, options.rig)
    from .study import run_learning

    record = config.record
    identity = {"command": "learn", "experiment": record.source, "rig": rig_table(record.rig)}
    if files := data_files(record.source):
        identity["files"] = files
    finish(options, words, Path(options.experiment).stem, identity, partial(run_learning, config))
