"""`jackbench fmu RIG`: its arguments."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ...base.errors import InputError
from ...rigs.platform import Platform, load_rig_or_platform
from ...rigs.rig import Rig
from ..common.new_folder import check_new
from ..common.shipped import experiment
from .compiler import compiler

if TYPE_CHECKING:
    from ...control.controller_spec import ControllerSpec


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="a bundled rig or platform, or a file of one")
    inside = "put this controller of a step experiment inside, sampled, with its delay and the guard"
    parser.add_argument("--controller", metavar="FILE:NAME", help=inside)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to make (default: RIG-fmu)")
    parser.set_defaults(call=_fmu)


def _fmu(options: argparse.Namespace, _words: list[str]) -> None:
    compiler()
    rig, spec = _loop(options) if options.controller else (load_rig_or_platform(options.rig), None)
    folder = options.out or Path(f"{rig.name}-fmu")
    check_new(folder)
    from .archive import leave_fmu
    from .model import fmu_model
    from .platform import platform_model

    model = platform_model(rig) if isinstance(rig, Platform) else fmu_model(rig, spec)
    name = f"{rig.name}-{spec.name}.fmu" if spec else f"{rig.name}.fmu"
    print(leave_fmu(folder, name, model))


def _loop(options: argparse.Namespace) -> tuple[Rig, "ControllerSpec"]:
    """The rig with the experiment's specimen and the controller's delay, and the controller. Raises InputError."""
    from ...loop.rig_variations import with_delay
    from ..common.step_experiment import load_steps

    file, _, name = options.controller.rpartition(":")
    if not file:
        raise InputError(f"--controller {options.controller}: name an experiment and its controller, FILE:NAME")
    config = load_steps(experiment(file), options.rig, name)
    (spec,) = config.controllers
    return with_delay(config.rig, config.conditions.delay(spec, config.rig)), spec
