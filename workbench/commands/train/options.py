"""`jackbench train EXPERIMENT`: searches a policy's weights and leaves them with trained.toml, an experiment of it."""

import argparse
from functools import partial
from pathlib import Path

from ..common.experiment import data_files
from ..common.options import computes, finish, jobs, works
from ..common.shipped import experiment
from .config import load_train


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a train experiment, such as experiments/train_p_dp.toml")
    works(parser)
    computes(parser, _train)


def _train(options: argparse.Namespace, words: list[str]) -> None:
    config = load_train(options.experiment, options.rig)
    from .study import run_train

    identity = {"command": "train", "experiment": config.source, "rig": config.start.rig.table()}
    identity["files"] = data_files(config.source)
    finish(options, words, Path(options.experiment).stem, identity, partial(run_train, config, jobs=jobs(options)))
