"""The files of a starter folder: a first loop gain follows from the rig's velocity gain, mode and valve."""

from string import Template

import numpy as np

from ...base.errors import InputError
from ...control.controller_type import controller
from ...linear import equilibrium
from ...loop.margins import linear_loop
from ...plant import build
from ...rigs.platform import Platform
from ...rigs.platform.platform_file import platform_files
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from .. import COMMANDS
from ..common.shipped import shipped
from ..show.describe import derived
from ..show.rig_file import rig_file
from .experiments import TEMPLATES, experiments

MARGIN = 7.0  # dB of gain at null, where the lap doubles it
CROSSOVER = 0.2  # of the mode's frequency, at most
FULL = 0.02  # m: the error that asks for full command, at least
CONTROLLER = "tutorial/slewed_p.py"


def starter_files(rig: Rig | Platform, name: str | None) -> dict[str, str]:
    """The text of every file, by its path in the folder; `name`: how the rig was named, None for one that was built."""
    is_platform = isinstance(rig, Platform)
    own = platform_files(rig) if is_platform else _files_of_a_jack(rig, name)
    made = experiments("platform", {}, own) if is_platform else experiments("jack", _numbers(rig), own)
    text, more = (TEMPLATES / ("platform.md" if is_platform else "README.md")).read_text("utf-8"), []
    for file in (file for file in made if f" {file} " not in text):
        kind, about = file.removesuffix(".toml"), made[file].splitlines()[0].removeprefix("# ").partition(". ")[0]
        command = f"jackbench {kind if kind in COMMANDS else 'run'} {file}"
        more.append(f"    {command:<44} # {about}")
    return {**own, **made, "README.md": Template(text).substitute(rig=rig.name, more="\n".join(more))}


def _files_of_a_jack(rig: Rig, name: str | None) -> dict[str, str]:
    return {
        "rig.toml": rig_text(rig) if name is None else rig_file(name, rig),
        "mine.py": (shipped() / CONTROLLER).read_text("utf-8"),
        "campaign/campaign.toml": (TEMPLATES / "campaign" / "campaign.toml").read_text("utf-8"),
    }


def _numbers(rig: Rig) -> dict[str, str]:
    """What the experiments leave open, which follows from the rig."""
    rows = {row["name"]: row["value"] for row in derived(rig)}
    fastest = CROSSOVER * 2 * np.pi * rows["natural frequency, linearised"] / rows["velocity gain at null"]
    gain = min(fastest, 1 / FULL, margin_gain(rig))
    return {
        "gain": f"{gain:.2g}",
        "low": f"{gain / 4:.2g}",
        "high": f"{gain * 2:.2g}",
        "margin": f"{MARGIN:g}",
        "velocity_gain": f"{rows['velocity gain at null']:.3g}",
        "mode": f"{rows['natural frequency, linearised']:.3g}",
        "damping": f"{rows['damping, linearised']:.2g}",
    }


def margin_gain(rig: Rig) -> float:
    """The gain [1/m] of a proportional position loop with MARGIN at null. Raises InputError where there is none."""
    plant, period, trial = build(rig), rig.period.value, 0.01
    smooth = plant.without_dry_friction()
    law = controller("controllers.p:P", gain=trial).build(period)
    margin = linear_loop(plant, equilibrium(plant, p=smooth), law, period, smooth).gain_margin_db
    if margin is None:
        raise InputError(f"rig {rig.name}: no gain margin of a proportional position loop at null; choose another rig")
    return trial * 10 ** ((margin - MARGIN) / 20)
