"""The laws of an experiment in the forms that are exported."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...control.export import Coefficients, coefficients
from ...control.export.program import Program, program_of
from ...control.protocol import Controller
from ...linear import Equilibrium, equilibrium
from ...loop.sampled_lanes import sampled_lane
from ...plant import Plant, build
from ...rigs.rig import Rig


@dataclass(frozen=True)
class Exported:
    """A controller with its code, and its sections or why there are none."""

    controller: Controller
    program: Program
    sections: Coefficients | str


def exported(rig: Rig, specs: Sequence[ControllerSpec], linear: bool) -> tuple[list[Exported], list[str]]:
    """Controllers for a rig, `linear`: by their linear view alone; and a sentence for each that is not exported."""
    laws, notes, period = [], [], rig.period.value
    at = mid_stroke(rig)[2]
    for spec in specs:
        controller = spec.build(period)
        try:
            program = program_of(spec.name, controller, linear, at)
        except InputError as error:
            notes.append(f"{spec.name}: {error}")
            continue
        try:
            laws.append(Exported(controller, program, coefficients(program.law)))
        except InputError as error:
            laws.append(Exported(controller, program, str(error)))
    return laws, notes


def mid_stroke(rig: Rig) -> tuple[Plant, Equilibrium, Mapping[str, float]]:
    """A rig's plant at rest at mid stroke and null, and the signals there."""
    plant = build(rig)
    smooth = plant.without_dry_friction()
    about = equilibrium(plant, p=smooth)
    return plant, about, sampled_lane(plant, about, rig.period.value, smooth).point
