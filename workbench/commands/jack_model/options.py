"""`jackbench jack-model EXPERIMENT`: the jack in six numbers, with the compensators of each controller closed."""

import argparse
from dataclasses import asdict, fields
from typing import cast

from ...control.compensators import Compensator, MapsCommand
from ..common.designs import of_controllers, print_each
from ..common.step_experiment import load_steps


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    of_controllers(parser, _jack_model)


def _jack_model(options: argparse.Namespace, _words: list[str]) -> None:
    config = load_steps(options.experiment, options.rig, options.controller)
    from ...control.inner_loop import inner_loop_closed
    from ...control.jack_model import JackModel, fit_jack_model
    from ...linear import equilibrium
    from ...linear.operating_point import moving_point
    from ...plant import build

    plant, period = build(config.rig), config.rig.period.value
    smooth = plant.without_dry_friction()
    points = {
        "null": equilibrium(plant, p=smooth),
        "moving": moving_point(plant, config.rig.passing_speed, p=smooth)[0],
    }
    models: dict[str, dict[str, dict[str, float]]] = {}
    for spec in config.controllers:
        parts = [cast("Compensator | MapsCommand", part.build(period)) for part in spec.compensators]
        models[spec.name] = {
            where: asdict(fit_jack_model(inner_loop_closed(plant, about, period, parts, smooth)))
            for where, about in points.items()
        }
    units = {entry.name: entry.metadata["unit"] for entry in fields(JackModel)}

    def text(name: str) -> str:
        return "\n".join(
            f"# {name}, {where}\n"
            + "\n".join(f'{key} = {{value = {value:.5g}, unit = "{units[key]}"}}' for key, value in numbers.items())
            for where, numbers in models[name].items()
        )

    print_each(options, models, text)
