"""`jackbench tune EXPERIMENT`: searches a controller's numbers and leaves tuned.toml, an experiment of the best."""

import argparse
from functools import partial
from pathlib import Path

from ..common.experiment import data_files
from ..common.options import computes, finish, jobs, works
from ..common.shipped import experiment
from .config import load_tune


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a tune experiment, such as experiments/tune_p_dp.toml")
    works(parser)
    computes(parser, _tune)


def _tune(options: argparse.Namespace, words: list[str]) -> None:
    config = load_tune(options.experiment, options.rig)
    from .study import run_tune

    identity = {"command": "tune", "experiment": config.source, "rig": config.start.rig.table()}
    if files := data_files(config.source):
        identity["files"] = files
    finish(options, words, Path(options.experiment).stem, identity, partial(run_tune, config, jobs=jobs(options)))
