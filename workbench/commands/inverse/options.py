"""`jackbench inverse EXPERIMENT`: its arguments."""

import argparse
from functools import partial
from pathlib import Path

from ...rigs.rig import rig_table
from ..common.experiment import data_files
from ..common.options import computes, finish
from ..common.shipped import experiment
from .config import load_inverse


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="such as experiments/inverse.toml")
    computes(parser, _inverse)


def _inverse(options: argparse.Namespace, words: list[str]) -> None:
    config = load_inverse(options.experiment, options.rig)
    from .study import run_inverse

    record = config.record
    identity = {"command": "inverse", "experiment": record.source, "rig": rig_table(record.rig)}
    if files := data_files(record.source):
        identity["files"] = files
    finish(options, words, Path(options.experiment).stem, identity, partial(run_inverse, config))
