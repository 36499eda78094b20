"""`jackbench speed`: this engine beside public solvers, in one run."""

import argparse
from functools import partial

from ...rigs.rig_file import load_rig
from ..common.options import computes, finish


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    computes(parser, _speed)


def _speed(options: argparse.Namespace, words: list[str]) -> None:
    rig = load_rig(options.rig or "jack-10t")
    from .study import run_speed

    finish(options, words, "speed", {"command": "speed", "rig": rig.table()}, partial(run_speed, rig))
