"""The motion that a platform plays: a road of a class along one axis, or a file with poses."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import InputError, nearest
from ...base.table import Table
from ...base.units import Spec
from ...loop.platform.poses import recorded_pose, road_pose
from ...records.frequency_sheet import Columns
from ...records.road import CLASSES
from ...rigs.platform import AXES, Platform

_ROAD = ("axis", "road", "speed", "duration", "band_hz", "peak")
_LONGEST = 60.0  # s


@dataclass(frozen=True, eq=False)
class PlatformRecord:
    """Poses [k, 6] at the control period, played once and corrected `iterations` times, up to the `highest` frequency
    [Hz]."""

    title: str
    pose: np.ndarray
    iterations: int
    highest: float


def read_record(table: Table, platform: Platform) -> PlatformRecord:
    """The table [record] of an experiment on a platform, and its file. Raises InputError."""
    table.allow("file", *_ROAD, "iterations", "highest_hz")
    highest, nyquist = table.positive("highest_hz"), 0.5 / platform.period
    if not highest <= nyquist:
        raise table.complaint("highest_hz", f"must not be above {nyquist:g} Hz")
    title, pose = _file(table, platform) if "file" in table else _road(table, platform)
    return PlatformRecord(title, pose, table.count("iterations", 1, 100), highest)


def _file(table: Table, platform: Platform) -> tuple[str, np.ndarray]:
    """Title and poses of a file with t and the axes that move."""
    if others := [key for key in _ROAD if key in table]:
        raise table.complaint(others[0], "not together with file; remove one")
    columns = table.about("file", lambda: Columns(Path(table.text("file"))))
    if unknown := [name for name in columns.cells if name not in ("t", *AXES)]:
        raise InputError(f'{columns.path}: column "{unknown[0]}": no axis; {nearest(unknown[0], AXES)}')
    if not (axes := [axis for axis in AXES if axis in columns]):
        raise InputError(f'{columns.path}: no column of an axis; add one such as "heave [mm]" or "pitch [deg]"')
    t = columns.values("t", "s")
    if len(t) < 2 or not np.all(np.diff(t) > 0):
        raise InputError(f"{columns.path}: t must rise from row to row, over two rows or more; mend it")
    if t[-1] - t[0] > _LONGEST:
        raise InputError(f"{columns.path}: {t[-1] - t[0]:g} s are above {_LONGEST:g} s; cut it")
    values = np.zeros((len(t), len(AXES)))
    for axis in axes:
        i = AXES.index(axis)
        values[:, i] = columns.values(axis, "m" if i < 3 else "rad")
    return columns.path.name, recorded_pose(platform, t, values)


def _road(table: Table, platform: Platform) -> tuple[str, np.ndarray]:
    """Title and poses of a road."""
    band, nyquist = table.numbers("band_hz", "[0.5, 10]"), 0.5 / platform.period
    if len(band) != 2 or not 0.1 <= band[0] < band[1] <= nyquist:
        raise table.complaint("band_hz", f"must be two frequencies from 0.1 to {nyquist:g} Hz, such as [0.5, 10]")
    axis, kind = table.word("axis", AXES), table.word("road", CLASSES)
    speed = table.quantity("speed", Spec("m/s", 0.1, 100.0, "speed at which the road is driven"))
    seconds = table.quantity("duration", Spec("s", 1.0, _LONGEST, "of the road"))
    peak = table.quantity("peak", Spec("m", 1e-6, 1.0, "largest deviation at the joints"))
    numbers = AXES.index(axis), kind, speed, seconds, (band[0], band[1]), peak
    return f"A road along {axis}", table.about("road", lambda: road_pose(platform, *numbers))
