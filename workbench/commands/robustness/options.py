"""`jackbench robustness EXPERIMENT`: its arguments."""

import argparse
from functools import partial
from pathlib import Path

from ...base.errors import InputError
from ...rigs.rig import rig_table
from ..common.options import computes, finish
from ..common.shipped import experiment
from .config import load_robustness


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="such as experiments/robustness.toml")
    parser.add_argument("--plants", type=int, metavar="N", help="how many to draw (default: as the experiment says)")
    computes(parser, _robustness)


def _robustness(options: argparse.Namespace, words: list[str]) -> None:
    if options.plants is not None and options.plants < 1:
        raise InputError(f"--plants {options.plants}: must be 1 or more")
    config = load_robustness(options.experiment, options.rig, options.plants)
    from .study import run_robustness

    identity = {"command": "robustness", "experiment": config.source, "plants": config.plants}
    identity["rig"] = rig_table(config.rig)
    finish(options, words, Path(options.experiment).stem, identity, partial(run_robustness, config))
