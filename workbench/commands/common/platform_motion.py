"""The motion that a platform plays: a road of a class along one axis, or a file with poses or accelerations."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import InputError, nearest
from ...base.table import ConfigTable
from ...base.units import Spec, converts
from ...loop.platform.poses import accelerated_pose, lowest_corner, recorded_pose, road_pose
from ...records.frequency_sheet import Columns
from ...records.road import CLASSES
from ...rigs.platform import AXES, Platform

ROAD = ("axis", "road", "speed", "seconds", "band_hz", "peak")
MOTION = ("file", "highpass_hz", *ROAD)
_LONGEST = 60.0  # s
_POSES, _ACCELERATIONS = ("m", "m", "m", "rad", "rad", "rad"), ("m/s^2", "m/s^2", "m/s^2", *3 * ("rad/s^2",))


@dataclass(frozen=True, eq=False)
class PlatformMotion:
    """Poses [k, 6] at the control period, and what they are."""

    title: str
    pose: np.ndarray


@dataclass(frozen=True, eq=False)
class PlatformRecord(PlatformMotion):
    """A motion that is played once and corrected `iterations` times, up to the `highest` frequency [Hz]."""

    iterations: int
    highest: float


def read_record(table: ConfigTable, platform: Platform) -> PlatformRecord:
    """The table [record] of an experiment on a platform, and its file. Raises InputError."""
    table.allow(*MOTION, "iterations", "highest_hz")
    highest, nyquist = table.positive("highest_hz"), 0.5 / platform.period
    if not highest <= nyquist:
        raise table.complaint("highest_hz", f"must not be above {nyquist:g} Hz")
    motion = read_motion(table, platform)
    return PlatformRecord(motion.title, motion.pose, table.count("iterations", 1, 100), highest)


def read_motion(table: ConfigTable, platform: Platform) -> PlatformMotion:
    """The motion of a table, and its file. Raises InputError."""
    return _file(table, platform) if "file" in table else _road(table, platform)


def file_motion(path: Path, platform: Platform) -> PlatformMotion:
    """The motion of a file with poses, or with accelerations above the lowest frequency that the legs have the stroke
    for. Raises InputError."""
    course = _course(Columns(path))
    if not course.accelerations:
        return _posed(course, platform)
    try:
        return _accelerated(course, platform, lowest_corner(platform, course.t, course.values))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _file(table: ConfigTable, platform: Platform) -> PlatformMotion:
    """The motion of a file with t and the axes that move."""
    if others := [key for key in ROAD if key in table]:
        raise table.complaint(others[0], "not together with file; remove one")
    course = _course(table.about("file", lambda: Columns(Path(table.text("file")))))
    if not course.accelerations:
        if "highpass_hz" in table:
            raise table.complaint("highpass_hz", "of accelerations, and the file has poses; remove it")
        return _posed(course, platform)
    if "highpass_hz" in table:
        corner, nyquist = table.positive("highpass_hz"), 0.5 / platform.period
        if not 0.05 <= corner < nyquist:
            raise table.complaint("highpass_hz", f"must be between 0.05 and {nyquist:g} Hz")
    else:
        corner = table.about("file", lambda: lowest_corner(platform, course.t, course.values))
    return _accelerated(course, platform, corner)


@dataclass(frozen=True, eq=False)
class _Course:
    """What a file called `name` has: rising times t [n] s, and values [n, 6] of all axes, poses or accelerations."""

    name: str
    t: np.ndarray
    values: np.ndarray
    accelerations: bool


def _course(columns: Columns) -> _Course:
    if unknown := [name for name in columns.cells if name not in ("t", *AXES)]:
        raise InputError(f'{columns.path}: column "{unknown[0]}": no axis; {nearest(unknown[0], AXES)}')
    if not (axes := [axis for axis in AXES if axis in columns]):
        raise InputError(f'{columns.path}: no column of an axis; add one such as "heave [mm]" or "pitch [deg]"')
    t = columns.times()
    if t[-1] - t[0] > _LONGEST:
        raise InputError(f"{columns.path}: {t[-1] - t[0]:g} s are above {_LONGEST:g} s; cut it")
    accelerations = {axis for axis in axes if converts(columns.unit(axis), _ACCELERATIONS[AXES.index(axis)])}
    if accelerations and (poses := [axis for axis in axes if axis not in accelerations]):
        raise InputError(f"{columns.path}: {poses[0]} is no acceleration and others are; make all of one kind")
    values, units = np.zeros((len(t), len(AXES))), _ACCELERATIONS if accelerations else _POSES
    for axis in axes:
        i = AXES.index(axis)
        values[:, i] = columns.values(axis, units[i])
    return _Course(columns.path.name, t, values, bool(accelerations))


def _posed(course: _Course, platform: Platform) -> PlatformMotion:
    return PlatformMotion(course.name, recorded_pose(platform, course.t, course.values))


def _accelerated(course: _Course, platform: Platform, corner: float) -> PlatformMotion:
    title = f"{course.name}, accelerations above {corner:.3g} Hz"
    return PlatformMotion(title, accelerated_pose(platform, course.t, course.values, corner))


def _road(table: ConfigTable, platform: Platform) -> PlatformMotion:
    """The motion of a road."""
    if "highpass_hz" in table:
        raise table.complaint("highpass_hz", "of a file with accelerations; remove it")
    band, nyquist = table.numbers("band_hz", "[0.5, 10]"), 0.5 / platform.period
    if len(band) != 2 or not 0.1 <= band[0] < band[1] <= nyquist:
        raise table.complaint("band_hz", f"must be two frequencies from 0.1 to {nyquist:g} Hz, such as [0.5, 10]")
    axis, kind = table.word("axis", AXES), table.word("road", CLASSES)
    speed = table.quantity("speed", Spec("m/s", 0.1, 100.0, "speed at which the road is driven"))
    seconds = table.quantity("seconds", Spec("s", 1.0, _LONGEST, "of the road"))
    peak = table.quantity("peak", Spec("m", 1e-6, 1.0, "largest deviation at the joints"))
    numbers = AXES.index(axis), kind, speed, seconds, (band[0], band[1]), peak
    pose = table.about("road", lambda: road_pose(platform, *numbers))
    return PlatformMotion(f"A road along {axis}", pose)
