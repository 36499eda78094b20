"""`jackbench show RIG`: every number of a rig, and what follows from them."""

import argparse
import json

from ...rigs.rig import load_rig
from ..common.options import prints


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="a bundled rig or a rig file")
    prints(parser, _show)


def _show(options: argparse.Namespace, _words: list[str]) -> None:
    rig = load_rig(options.rig)
    from .describe import describe, describe_text

    table = describe(rig)
    print(json.dumps(table, indent=2) if options.json else describe_text(table))
