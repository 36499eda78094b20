"""`jackbench faults EXPERIMENT`: its arguments."""

import argparse
from functools import partial
from pathlib import Path

from ..common.options import computes, draws, finish, plants
from ..common.shipped import experiment
from .config import load_faults


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a faults experiment, such as experiments/faults.toml")
    draws(parser, "number of drawn plants without a fault (default: the experiment's)")
    computes(parser, _faults)


def _faults(options: argparse.Namespace, words: list[str]) -> None:
    config = load_faults(options.experiment, options.rig, plants(options))
    from .study import run_faults

    identity = {"command": "faults", "experiment": config.source, "plants": config.plants}
    identity["rig"] = config.rig.table()
    finish(options, words, Path(options.experiment).stem, identity, partial(run_faults, config))
