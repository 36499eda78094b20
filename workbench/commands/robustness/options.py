"""`jackbench robustness EXPERIMENT`: its arguments."""

import argparse
from functools import partial
from pathlib import Path

from ..common.options import computes, draws, finish, jobs, plants, works
from ..common.shipped import experiment
from .config import load_any


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "experiment", type=experiment, help="a robustness experiment, such as experiments/robustness.toml"
    )
    draws(parser)
    works(parser)
    computes(parser, _robustness)


def _robustness(options: argparse.Namespace, words: list[str]) -> None:
    config = load_any(options.experiment, options.rig, plants(options))
    identity = {"command": "robustness", "experiment": config.source, "plants": config.plants}
    identity["rig"] = config.rig.table()
    from .platform_study import run_any

    finish(options, words, Path(options.experiment).stem, identity, partial(run_any, config, jobs=jobs(options)))
