"""What commands that print something of each controller of an experiment share."""

import argparse
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from ...base.errors import InputError
from .options import Call, prints
from .shipped import experiment
from .step_experiment import StepConfig, load_steps


def of_controllers(parser: argparse.ArgumentParser, call: Call) -> None:
    """Options of such a command."""
    parser.add_argument(
        "experiment", type=experiment, help="a step experiment, such as experiments/position_crone.toml"
    )
    parser.add_argument("--rig", help="a bundled rig or a rig file, instead of the experiment's")
    parser.add_argument("--controller", metavar="NAME", help="the one controller to take (default: all)")
    prints(parser, call)


def read(options: argparse.Namespace) -> StepConfig:
    """The experiment, with the wanted controllers only."""
    config = load_steps(options.experiment, options.rig)
    names = [controller.name for controller in config.controllers]
    if options.controller not in (None, *names):
        raise InputError(f"{options.experiment}: no controller {options.controller}; it has {', '.join(names)}")
    controllers = tuple(spec for spec in config.controllers if options.controller in (None, spec.name))
    return replace(config, controllers=controllers)


def print_each(options: argparse.Namespace, results: Mapping[str, Any], text: Callable[[str], str]) -> None:
    """The result of each controller, as JSON, or as text by its name."""
    print(json.dumps(results, indent=2) if options.json else "\n\n".join(text(name) for name in results))
