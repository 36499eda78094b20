"""`jackbench drive EXPERIMENT --at udp://HOST:PORT`: its arguments."""

import argparse
from functools import partial

from ..common.declared import finish_experiment
from ..common.options import computes, on_link, on_opc_ua
from ..common.shipped import experiment
from ..common.step_experiment import load_steps


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a step experiment, such as experiments/first_loop.toml")
    on_link(parser, required=True)
    parser.add_argument(
        "--controller", metavar="NAME", help="the one controller of the experiment to play (default: all)"
    )
    on_opc_ua(parser)
    computes(parser, _drive)


def _drive(options: argparse.Namespace, words: list[str]) -> None:
    config = load_steps(options.experiment, options.rig, options.controller)
    from .study import run_drive

    more = {"at": options.at, "controllers": [spec.name for spec in config.controllers]}
    study = partial(run_drive, config, options.at, options.token, options.opcua)
    finish_experiment(options, words, "drive", config, study, "drive-", **more)
