"""Which records are at rest, which are fitted and which only judge."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.signals import DRIVING
from ...records import Record
from ..data.white_part import white_part

_REST_ROWS, _REST_TIME = 50, 0.05  # at least, of a stretch at rest
_STILL = 2e-3  # of full command, or of a reference's range: what moves less stands
_ALIKE = 0.02  # of a command's peak: repeats differ by less
_MOTION = ("position", "velocity", "force")
_NOISE = 8.0  # times the white noise: a signal that goes farther moves
_AT_REST = 4.0  # times these limits: a record that never goes farther is at rest
_SPLIT = 2 / 3  # of a file alone: what is fitted


@dataclass(frozen=True)
class RecordMotion:
    """How a record moves: from when to when [s], its peak command, its command thinned, until when [s] it rests."""

    name: str
    file: str
    start: float
    stop: float
    peak: float
    shape: np.ndarray
    rests_until: float | None
    at_rest: bool


@dataclass(frozen=True)
class Roles:
    """Entries of [records] by role, and the sentence that says why."""

    entries: Mapping[str, list[Any]]
    reason: str


def motion(record: Record, file: str) -> RecordMotion:
    """How a record moves."""
    name, t = next(name for name in DRIVING if name in record.signals), record.t
    command = record.signals[name]
    full = 1.0 if name == "command" else max(float(np.ptp(command)), np.finfo(float).tiny)
    moving = np.maximum(np.abs(command - command[0]) / full / _STILL, _moved(record))
    still = int(np.argmax(moving > 1.0)) if (moving > 1.0).any() else moving.size
    quiet = still >= _REST_ROWS and t[still - 1] - t[0] >= _REST_TIME
    at_rest = bool(moving.max() < _AT_REST)
    shape = np.interp(np.linspace(0, 1, 200), np.linspace(0, 1, command.size), command)
    until = float(t[still - 1]) if quiet and not at_rest else None
    return RecordMotion(
        record.name, file, float(t[0]), float(t[-1]), float(np.abs(command).max()), shape, until, at_rest
    )


def _moved(record: Record) -> np.ndarray:
    """How far [rows] what moves has moved since the first rows, in limits of its noise."""
    far = np.zeros(record.t.size)
    for name in [name for name in _MOTION if name in record.signals]:
        values = record.signals[name]
        noise = max(white_part(name, [record]).sigma, _resolution(values))
        if noise > 0:
            far = np.maximum(far, np.abs(values - np.median(values[:_REST_ROWS])) / (_NOISE * noise))
    return far


def _resolution(values: np.ndarray) -> float:
    """The smallest step of values [n]; 0 where they never change."""
    steps = np.abs(np.diff(values))
    return float(np.min(steps[steps > 0], initial=np.inf)) if steps.any() else 0.0


def roles(motions: Sequence[RecordMotion]) -> Roles:
    """Records at rest measure the noise; of commands that differ those of middle size judge, of repeats the last one.

    A file alone is fitted in its first part and judged in the rest.
    """
    still, moving = [m for m in motions if m.at_rest], [m for m in motions if not m.at_rest]
    static: list[Any] = [m.file for m in still] or _rests(moving)
    if not moving:
        return Roles(
            {"static": static, "train": [], "heldout": []}, "nothing moves: record the rig with its command moving"
        )
    if len(moving) == 1:
        whole = moving[0]
        cut = float(f"{whole.start + _SPLIT * (whole.stop - whole.start):.6g}")
        entries = {"train": [{"file": whole.file, "to": cut}], "heldout": [{"file": whole.file, "from": cut}]}
        reason = (
            f"one record that moves: fitted until {cut:g} s, judged by the rest; better, record another and hold it out"
        )
        return Roles({"static": static, **entries}, reason)
    groups = sorted(_repeats(moving), key=lambda group: group[0].peak)
    if len(groups) == 1:
        held = [groups[0][-1].file]
        reason = "all repeat one command, the last is held out; better, record another command and hold it out"
    else:
        middle = groups[(len(groups) - 1) // 2]
        held = [m.file for m in middle]
        place = "between the others" if len(groups) > 2 else "the smaller of two"
        size = f"the command that reaches {middle[0].peak:.3g}, {place}"
        reason = f"held out: {len(held)} of {len(moving)}, {size}"
    train = [m.file for m in moving if m.file not in held]
    return Roles({"static": static, "train": train, "heldout": held}, reason)


def by_order(files: Sequence[str]) -> Roles:
    """The roles of records of which nothing says how they move: the last is held out."""
    why = "how the records move is not known yet: the last is held out"
    return Roles({"static": [], "train": list(files[:-1]), "heldout": list(files[-1:])}, why)


def _rests(moving: Sequence[RecordMotion]) -> list[Any]:
    """The stretch at rest before the first move of the record that rests longest."""
    resting = [m for m in moving if m.rests_until is not None]
    longest = max(resting, key=lambda m: (m.rests_until or 0.0) - m.start, default=None)
    if longest is None or longest.rests_until is None:
        return []
    return [{"file": longest.file, "from": longest.start, "to": float(f"{longest.rests_until:.6g}")}]


def _repeats(moving: Sequence[RecordMotion]) -> list[list[RecordMotion]]:
    """Records by command: those of one group repeat it."""
    groups: list[list[RecordMotion]] = []
    for m in moving:
        for group in groups:
            size = max(np.ptp(group[0].shape), 1e-12)
            if np.sqrt(np.mean((group[0].shape - m.shape) ** 2)) < _ALIKE * size:
                group.append(m)
                break
        else:
            groups.append([m])
    return groups
