"""Experiments on a platform: controllers on its legs or modes, steps along its axes, sines, its workspace."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.table import ConfigTable
from ...base.units import Spec
from ...loop.platform.steps import AxisStep
from ...rigs.platform import AXES, Platform
from ...rigs.platform.platform import PAYLOAD
from ..common.experiment import MOST_POINTS
from ..common.platform_experiment import PlatformExperiment, platform_experiment, read_steps
from ..common.platform_motion import PlatformRecord, read_record

KEYS = (
    "experiment",
    "rig",
    "scenarios",
    "controllers",
    "transfer",
    "sines",
    "workspace",
    "variations",
    "record",
    "ideal",
    "seed",
)
_LENGTH, _ANGLE = Spec("m", 0.0, 100.0, ""), Spec("rad", 0.0, 3.2, "")
_SPEED, _TURNING = Spec("m/s", 0.0, 100.0, ""), Spec("rad/s", 0.0, 100.0, "")


@dataclass(frozen=True)
class Sines:
    """Stepped sines along every axis: frequencies [k], Hz, and the amplitude [m] of the platform's joints."""

    frequencies: tuple[float, ...]
    amplitude: float


@dataclass(frozen=True)
class Workspace:
    """Poses within +-`box` [6] of home, and a `twist` [6] at which flows are asked for."""

    box: np.ndarray
    twist: np.ndarray


@dataclass(frozen=True, kw_only=True)
class PlatformConfig(PlatformExperiment):
    """An experiment on a platform; `f` [k] are the frequencies of its linear transfer, Hz."""

    steps: tuple[AxisStep, ...]
    f: np.ndarray
    sines: Sines
    workspace: Workspace
    variations: Mapping[str, Mapping[str, float]]
    record: PlatformRecord | None


def platform_config(top: ConfigTable, path: Path, rig: str | None) -> PlatformConfig:
    """The tables of an experiment on a platform; `rig` replaces the one it names. Raises InputError."""
    top.allow(*KEYS)
    shared = platform_experiment(top, path, rig)
    platform, transfer = shared.rig, top.table("transfer", "low_hz", "high_hz", "points")
    low, high = transfer.positive("low_hz"), transfer.positive("high_hz")
    if not low < high < 0.5 / platform.period:
        raise transfer.complaint("high_hz", f"must be above low_hz and below {0.5 / platform.period:g} Hz")
    return PlatformConfig(
        **vars(shared),
        steps=read_steps(top),
        f=np.geomspace(low, high, transfer.count("points", 3, MOST_POINTS)),
        sines=_sines(top.table("sines", "frequencies_hz", "amplitude"), platform),
        workspace=_workspace(top.table("workspace", "box", "speeds")),
        variations=_variations(top.optional_table("variations")),
        record=read_record(top.table("record"), platform) if "record" in top else None,
    )


def _sines(table: ConfigTable, platform: Platform) -> Sines:
    frequencies = table.numbers("frequencies_hz", "[1, 5]")
    if min(frequencies) < 0.1 or max(frequencies) > 0.05 / platform.period:
        raise table.complaint("frequencies_hz", f"must be between 0.1 and {0.05 / platform.period:g} Hz")
    return Sines(frequencies, table.quantity("amplitude", Spec("m", 1e-6, 1.0, "amplitude at the joints")))


def _variations(table: ConfigTable) -> dict[str, dict[str, float]]:
    """Payloads by name: numbers that are others than the platform's."""
    parts = {name: table.table(name, *PAYLOAD) for name in table}
    return {name: {key: part.quantity(key, PAYLOAD[key]) for key in part} for name, part in parts.items()}


def _workspace(table: ConfigTable) -> Workspace:
    specs = {"box": (_LENGTH, _ANGLE), "speeds": (_SPEED, _TURNING)}
    parts = {}
    for key, (linear, angular) in specs.items():
        part = table.table(key, *AXES)
        parts[key] = np.array([part.quantity(axis, linear if i < 3 else angular) for i, axis in enumerate(AXES)])
    return Workspace(parts["box"], parts["speeds"])
