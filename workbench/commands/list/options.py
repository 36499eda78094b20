"""`jackbench list rigs|controllers|effects|experiments`."""

import argparse
import json

from ..common.options import prints
from .catalogue import KINDS, listing, listing_text


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("kind", metavar="|".join(KINDS))
    prints(parser, _list)


def _list(options: argparse.Namespace, _words: list[str]) -> None:
    rows = listing(options.kind)
    print(json.dumps(rows, indent=2) if options.json else listing_text(rows))
