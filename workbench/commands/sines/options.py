"""`jackbench sines EXPERIMENT`: its arguments."""

import argparse
from functools import partial
from pathlib import Path

from ..common.experiment import data_files
from ..common.options import computes, draws, finish, plants
from ..common.shipped import experiment
from .config import load_sines


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a sines experiment, such as experiments/sines.toml")
    draws(parser)
    computes(parser, _sines)


def _sines(options: argparse.Namespace, words: list[str]) -> None:
    config = load_sines(options.experiment, options.rig, plants(options))
    from .study import run_sines

    identity = {"command": "sines", "experiment": config.source, "plants": config.plants, "rig": config.rig.table()}
    if files := data_files(config.source):
        identity["files"] = files
    finish(options, words, Path(options.experiment).stem, identity, partial(run_sines, config))
