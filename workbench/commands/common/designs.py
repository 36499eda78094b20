"""What commands that print something of each controller of an experiment share."""

import argparse
import json
from collections.abc import Callable, Mapping
from typing import Any

from .options import Call, prints
from .shipped import experiment


def of_controllers(parser: argparse.ArgumentParser, call: Call) -> None:
    """Options of such a command."""
    parser.add_argument(
        "experiment", type=experiment, help="a step experiment, such as experiments/position_crone.toml"
    )
    parser.add_argument("--rig", help="a bundled rig or a rig file, instead of the experiment's")
    parser.add_argument("--controller", metavar="NAME", help="the one controller to take (default: all)")
    prints(parser, call)


def print_each(options: argparse.Namespace, results: Mapping[str, Any], text: Callable[[str], str]) -> None:
    """The result of each controller, as JSON, or as text by its name."""
    print(json.dumps(results, indent=2) if options.json else "\n\n".join(text(name) for name in results))
