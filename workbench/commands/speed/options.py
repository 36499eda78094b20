"""`jackbench speed`: this engine beside public solvers, in one run."""

import argparse
from functools import partial

from ...base.errors import InputError
from ...rigs.rig_file import load_rig
from ..common.options import computes, finish


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("--link", action="store_true", help="time a rig behind the wire instead, beside an empty loop")
    parser.add_argument("--minutes", type=float, default=10.0, help="time at each rate, with --link (default: 10)")
    computes(parser, _speed)


def _speed(options: argparse.Namespace, words: list[str]) -> None:
    rig = load_rig(options.rig or "jack-10t")
    if options.link:
        if not 0 < options.minutes < 1000:
            raise InputError(f"--minutes {options.minutes:g}: must be above 0, below 1000")
        from .link import run_link_speed

        identity = {"command": "speed", "rig": rig.table(), "link": options.minutes}
        finish(options, words, "speed-link", identity, partial(run_link_speed, rig, options.minutes))
        return
    from .study import run_speed

    finish(options, words, "speed", {"command": "speed", "rig": rig.table()}, partial(run_speed, rig))
