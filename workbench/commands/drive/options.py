"""`jackbench drive EXPERIMENT --at udp://HOST:PORT`: its arguments."""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

from ...base.errors import InputError, nearest
from ..common.options import computes, finish, on_link
from ..common.shipped import experiment
from ..common.step_experiment import StepConfig, load_steps


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a step experiment, such as experiments/first_loop.toml")
    on_link(parser, required=True)
    parser.add_argument(
        "--controller", metavar="NAME", help="the one controller of the experiment to play (default: all)"
    )
    parser.add_argument("--opcua", type=int, metavar="N", help="port of the OPC UA server for a SCADA panel")
    computes(parser, _drive)


def _drive(options: argparse.Namespace, words: list[str]) -> None:
    config = _chosen(load_steps(options.experiment, options.rig), options.controller)
    from .study import run_drive

    names = [spec.name for spec in config.controllers]
    identity = {"command": "drive", "experiment": config.source, "rig": config.rig.table(), "at": options.at}
    study = partial(run_drive, config, options.at, options.token, options.opcua)
    finish(options, words, f"drive-{Path(options.experiment).stem}", identity | {"controllers": names}, study)


def _chosen(config: StepConfig, name: str | None) -> StepConfig:
    if name is None:
        return config
    chosen = tuple(spec for spec in config.controllers if spec.name == name)
    if not chosen:
        hint = nearest(name, [spec.name for spec in config.controllers])
        raise InputError(f"--controller {name}: not in this experiment; {hint}")
    return replace(config, controllers=chosen)
