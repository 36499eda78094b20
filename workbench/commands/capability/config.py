"""What `jackbench capability` is asked, with the files that it names read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...identify.acceptance.row import AcceptanceLimit
from ...loop.reach import sampled_record
from ...records import Record
from ...records.frequency_sheet import Columns
from ...rigs.rig import Rig
from ..common.sheet_options import Made
from .catalogue import Catalogue


@dataclass(frozen=True, eq=False)
class DriveAsked:
    """A drive file: positions [k] m from mid stroke at the control period, and what it is held against: the `band`
    [Hz], a `cooler` [W], a share `sag` of the supply, a catalogue; None where none is given."""

    name: str
    position: np.ndarray
    band: float | None
    cooler: float | None
    sag: float
    catalogue: Catalogue | None


@dataclass(frozen=True, eq=False)
class CapabilityAsked:
    """A rig; the loop that is played, else one that tunes itself; a `pump` [m^3/s]; measured records; a drive file;
    limits by line."""

    rig: Rig
    made: Made
    loop: ControllerSpec | None = None
    pump: float | None = None
    records: Sequence[Record] = ()
    drive: DriveAsked | None = None
    limits: Mapping[str, AcceptanceLimit] = field(default_factory=dict)


def read_course(path: Path, rig: Rig) -> np.ndarray:
    """Positions [k] m from mid stroke, where its first row is, at the control period of a rig: a CSV with `t` and
    `position`. Raises InputError for one that leads beyond the stroke."""
    columns = Columns(path)
    t, values = columns.times(), columns.values("position", "m")
    record, period = sampled_record(t, values, rig.period.value), rig.period.value
    at = np.arange(int(record.t[-1] / period + 1e-6) + 1) * period
    position = np.interp(at, record.t, record.values)
    if (most := float(np.abs(position).max())) > rig.limit("stroke"):
        limit = f"{1e3 * rig.limit('stroke'):g} mm of mid stroke"
        raise InputError(f"{path}: goes {1e3 * most:.4g} mm from mid stroke; {rig.name} goes {limit} at most")
    return position
