"""`jackbench knowledge EXPERIMENT`: its arguments."""

import argparse
from functools import partial
from pathlib import Path

from ..common.options import computes, draws, finish, jobs, plants, works
from ..common.shipped import experiment
from .config import load_knowledge


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "experiment", type=experiment, help="a knowledge experiment, such as experiments/knowledge.toml"
    )
    draws(parser)
    works(parser)
    computes(parser, _knowledge)


def _knowledge(options: argparse.Namespace, words: list[str]) -> None:
    config = load_knowledge(options.experiment, options.rig, plants(options))
    from .study import run_knowledge

    identity = {"command": "knowledge", "experiment": config.source, "plants": config.plants}
    identity["rig"] = config.rig.table()
    name = Path(options.experiment).stem
    finish(options, words, name, identity, partial(run_knowledge, config, jobs=jobs(options)))
