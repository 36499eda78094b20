"""`python -m experiments.studies.closed_loop`: its arguments."""

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from workbench.cli import script
from workbench.commands.common.options import bounded, computes, finish


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    bounded(parser, "--number", 1, "rigs to draw (default: 40)", default=40)
    bounded(parser, "--seed", 0, "seed of the rigs and of their noise (default: 1)", default=1)
    parser.add_argument("--names", action="store_true", help="what a trace names where the loops lack an effect")
    parser.add_argument(
        "--press", type=Path, metavar="FOLDER", help="instead: the figures of a press, of the folder of its recordings"
    )
    computes(parser, _closed_loop, rig=False)


def _closed_loop(options: argparse.Namespace, words: list[str]) -> None:
    from .names import run_names
    from .press import run_press
    from .study import run_closed_loop

    if options.press:
        identity = {"command": "press", "recordings": options.press.resolve().name}
        finish(options, words, "press", identity, partial(run_press, options.press.resolve()))
        return
    name, study = ("closed-loop-names", run_names) if options.names else ("closed-loop-study", run_closed_loop)
    identity = {"command": name, "number": options.number, "seed": options.seed}
    finish(options, words, name, identity, partial(study, options.number, options.seed))


def main(words: Sequence[str] | None = None) -> int:
    """Run it; 2 where it is asked for what cannot be."""
    what = "Measure how often the numbers of hidden loops lie within their intervals."
    return script("experiments.studies.closed_loop", what, options, words)


if __name__ == "__main__":
    sys.exit(main())
