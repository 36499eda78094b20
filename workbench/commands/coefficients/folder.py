"""The folder of laws that a rig's own controller, MATLAB and python-control take."""

import json
from collections.abc import Mapping
from pathlib import Path

from ...base.signals import MEASURED
from ...control.export import Coefficients, as_json
from ...control.export.c_code import c_code
from ...control.export.link_program import link_program
from ...control.export.matlab import mat_file
from ...control.export.sections import identifier
from ...control.export.structured_text import structured_text
from ...control.protocol import Controller, linear_view
from ...linear import equilibrium, linear_plant
from ...loop.sampled_lanes import sampled_lane
from ...plant import build
from ...rigs.rig import Rig
from ..common.new_folder import write_folder

Laws = Mapping[str, tuple[Controller, Coefficients]]


def leave_laws(folder: Path, rig: Rig, laws: Laws) -> str:
    """Write the files of every law and the plant's linear model; what was written, for people."""
    plant = build(rig)
    smooth = plant.without_dry_friction()
    about = equilibrium(plant, p=smooth)
    outputs = tuple(name for name in MEASURED if name in plant.outputs)
    model = linear_plant(plant, about, ("command",), outputs, smooth)
    files: dict[str, str | bytes] = {"plant.mat": mat_file(model)}
    at = sampled_lane(plant, about, rig.period.value, smooth).point
    for name, (controller, law) in laws.items():
        files[f"{identifier(name)}.json"] = json.dumps(as_json(law), indent=2) + "\n"
        files |= {**c_code(name, law), **structured_text(name, law)}
        files[f"{identifier(name)}.mat"] = mat_file(linear_view(controller, at))
    files |= link_program({name: law for name, (_, law) in laws.items()})
    write_folder(folder, files)
    return (
        f"{folder}: {', '.join(laws)} as .json, .c and .h, .st and .mat; link_main.c, which runs them at a rig behind "
        f"a wire; the plant at mid stroke and null, command to {', '.join(outputs)}, as plant.mat; SI units"
    )
