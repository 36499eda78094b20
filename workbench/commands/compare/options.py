"""`jackbench compare DIR DIR ...`: finished runs overlaid, with a table of differences."""

import argparse

from ..common.options import computes, finish
from .finished import fingerprint, load


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("folders", nargs="+", metavar="DIR", help="folders that commands left")
    computes(parser, _compare, rig=False)


def _compare(options: argparse.Namespace, words: list[str]) -> None:
    runs = load(options.folders)
    from .study import run_compare

    identity = {"command": "compare", "runs": fingerprint(runs)}
    name = "-".join(["compare", *(run.name.replace("/", "-") for run in runs)])
    finish(options, words, name, identity, lambda _stage, _say: run_compare(runs))
