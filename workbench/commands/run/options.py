"""`jackbench run EXPERIMENT`."""

import argparse
from pathlib import Path

from ..common.experiment import data_files
from ..common.options import computes, finish
from ..common.shipped import experiment
from .config import load_config


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="an experiment file, such as experiments/paper.toml")
    computes(parser, _run)


def _run(options: argparse.Namespace, words: list[str]) -> None:
    config = load_config(options.experiment, options.rig)
    from .study import study_of

    identity = {"command": "run", "experiment": config.source, "rig": config.rig.table()}
    if files := data_files(config.source):
        identity["files"] = files
    finish(options, words, Path(options.experiment).stem, identity, study_of(config))
