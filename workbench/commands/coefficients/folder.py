"""The folder of laws that a rig's own controller, MATLAB and python-control take."""

import json
from collections.abc import Sequence
from pathlib import Path

from ...base.signals import MEASURED
from ...control.export import as_json
from ...control.export.c_code import c_code
from ...control.export.link_program import link_program
from ...control.export.listing import mat_file
from ...control.export.program import identifier
from ...control.export.structured_text import structured_text
from ...control.protocol import linear_view
from ...linear import linear_plant
from ...rigs.rig import Rig
from ..common.new_folder import write_folder
from .laws import Exported, mid_stroke


def leave_laws(folder: Path, rig: Rig, laws: Sequence[Exported]) -> str:
    """Write the files of every law and the plant's linear model; what was written, for people."""
    plant, about, at = mid_stroke(rig)
    outputs = tuple(name for name in MEASURED if name in plant.outputs)
    model = linear_plant(plant, about, ("command",), outputs, plant.without_dry_friction())
    files: dict[str, str | bytes] = {"plant.mat": mat_file(model)}
    for law in laws:
        name = identifier(law.program.name)
        files[f"{name}.json"] = json.dumps(as_json(law.program, law.sections), indent=2) + "\n"
        files |= {**c_code(law.program), **structured_text(law.program)}
        files[f"{name}.mat"] = mat_file(linear_view(law.controller, at))
    files |= link_program([law.program for law in laws], rig.limit("command_rate"))
    write_folder(folder, files)
    return (
        f"{folder}: {', '.join(law.program.name for law in laws)} as .json, .c and .h, .st and .mat; link_main.c, "
        "which runs them at a rig behind a wire; the plant at mid stroke and null, command to "
        f"{', '.join(outputs)}, as plant.mat; SI units"
    )
