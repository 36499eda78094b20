"""What a recording in simulation is asked for: a rig, and files to play."""

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...base.errors import InputError
from ...records.excitation import Excitation, read_excitation
from ...rigs.rig import Rig
from ...rigs.rig_file import bundled, load_rig

OWN = "rig.toml"  # the rig beside its records, where it is not a bundled one


@dataclass(frozen=True)
class Plan:
    """What is to be recorded: the rig as it is simulated, what the campaign says of it, and files to play."""

    rig: Rig
    declared: str
    seed: int
    files: tuple[Excitation, ...] = ()


def plan(rig: str, files: Sequence[str | Path] = (), seed: int = 0) -> Plan:
    """Read a rig and the excitation files that are to be played instead of the standard set. Raises InputError."""
    loaded = load_rig(rig)
    if "position" not in loaded.sensors:
        raise InputError(f"rig {rig}: no position sensor, which its drive needs; add [sensors.position]")
    played = tuple(read_excitation(path, loaded.period.value, loaded["xmid"]) for path in files)
    names = [excitation.name for excitation in played]
    for name in names:
        if names.count(name) > 1 or name == "static":
            raise InputError(
                f"--play {name}.csv: each record needs a name of its own, static is taken; rename the file"
            )
    return Plan(loaded, rig if rig in bundled() and not loaded.effects else OWN, seed, played)


def identity(plan: Plan) -> dict[str, Any]:
    """What says, beside the rig, that a recording is the same one."""
    digests = {
        excitation.name: sha256(excitation.reference.tobytes() + excitation.command.tobytes()).hexdigest()[:16]
        for excitation in plan.files
    }
    return {"seed": plan.seed, "play": digests}
