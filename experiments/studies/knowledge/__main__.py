"""`python -m experiments.studies.knowledge`: its arguments."""

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from workbench.cli import script
from workbench.commands.common.options import bounded, computes, finish, jobs, works

from .config import load_knowledge


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "experiment", type=Path, help="a knowledge experiment, such as experiments/studies/knowledge/knowledge.toml"
    )
    bounded(parser, "--plants", 1, "number of plants to draw (default: the experiment's)")
    works(parser)
    computes(parser, _knowledge)


def _knowledge(options: argparse.Namespace, words: list[str]) -> None:
    config = load_knowledge(options.experiment, options.rig, options.plants)
    from .study import run_knowledge

    identity = {"command": "knowledge", "experiment": config.source, "plants": config.plants}
    identity["rig"] = config.rig.table()
    name = Path(options.experiment).stem
    finish(options, words, name, identity, partial(run_knowledge, config, jobs=jobs(options)))


def main(words: Sequence[str] | None = None) -> int:
    """Run it; 2 where it is asked for what cannot be."""
    return script(
        "experiments.studies.knowledge",
        "Measure how many seconds controllers gain when the rig's numbers are known better.",
        options,
        words,
    )


if __name__ == "__main__":
    sys.exit(main())
