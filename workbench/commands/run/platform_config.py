"""Experiments on a platform: controllers on its legs or modes, steps along its axes, sines, its workspace."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...base.units import Spec
from ...loop.platform.steps import AxisStep
from ...rigs.platform import AXES
from ...rigs.platform.platform import PAYLOAD
from ..common.declared import ExperimentFile, declared, part
from ..common.experiment import MOST_POINTS
from ..common.platform_experiment import PlatformExperiment, read_steps
from ..common.platform_motion import PlatformRecord, read_record

_LENGTH, _ANGLE = Spec("m", 0.0, 100.0, ""), Spec("rad", 0.0, 3.2, "")
_SPEED, _TURNING = Spec("m/s", 0.0, 100.0, ""), Spec("rad/s", 0.0, 100.0, "")


@dataclass(frozen=True)
class SteppedSines:
    """Stepped sines along every axis: frequencies [k], Hz, and the amplitude [m] of the platform's joints."""

    frequencies: tuple[float, ...]
    amplitude: float


@dataclass(frozen=True)
class Workspace:
    """Poses within +-`box` [6] of home, and a `twist` [6] at which flows are asked for."""

    box: np.ndarray
    twist: np.ndarray


def _frequencies(at: ExperimentFile) -> np.ndarray:
    transfer = at.top.table("transfer", "low_hz", "high_hz", "points")
    low, high = transfer.positive("low_hz"), transfer.positive("high_hz")
    if not low < high < 0.5 / at.rig.period:
        raise transfer.complaint("high_hz", f"must be above low_hz and below {0.5 / at.rig.period:g} Hz")
    return np.geomspace(low, high, transfer.count("points", 3, MOST_POINTS))


def _sines(at: ExperimentFile) -> SteppedSines:
    table, most = at.top.table("sines", "frequencies_hz", "amplitude"), 0.05 / at.rig.period
    frequencies = table.numbers("frequencies_hz", "[1, 5]")
    if min(frequencies) < 0.1 or max(frequencies) > most:
        raise table.complaint("frequencies_hz", f"must be between 0.1 and {most:g} Hz")
    return SteppedSines(frequencies, table.quantity("amplitude", Spec("m", 1e-6, 1.0, "amplitude at the joints")))


def _variations(at: ExperimentFile) -> dict[str, dict[str, float]]:
    """Payloads by name: numbers that are others than the platform's."""
    table = at.top.optional_table("variations")
    parts = {name: table.table(name, *PAYLOAD) for name in table}
    return {name: {key: part.quantity(key, PAYLOAD[key]) for key in part} for name, part in parts.items()}


def _workspace(at: ExperimentFile) -> Workspace:
    table, specs = at.top.table("workspace", "box", "speeds"), {"box": (_LENGTH, _ANGLE), "speeds": (_SPEED, _TURNING)}
    parts = {}
    for key, (linear, angular) in specs.items():
        part = table.table(key, *AXES)
        parts[key] = np.array([part.quantity(axis, linear if i < 3 else angular) for i, axis in enumerate(AXES)])
    return Workspace(parts["box"], parts["speeds"])


def _record(at: ExperimentFile) -> PlatformRecord | None:
    return read_record(at.top.table("record"), at.rig) if "record" in at.top else None


@declared
class PlatformConfig(PlatformExperiment):
    """An experiment on a platform; `f` [k] are the frequencies of its linear transfer, Hz."""

    KIND = "platform"
    steps: tuple[AxisStep, ...] = part(read_steps, {"scenarios": "steps along axes of the pose"})
    f: np.ndarray = part(_frequencies, {"transfer": "range and points of the linear transfer"})
    sines: SteppedSines = part(_sines, {"sines": "stepped sines along every axis"})
    workspace: Workspace = part(_workspace, {"workspace": "poses, and speeds at which flows are asked for"})
    variations: Mapping[str, Mapping[str, float]] = part(_variations, {"variations": "other payloads, by name"})
    record: PlatformRecord | None = part(_record, {"record": "a motion that is played"})
