"""Experiments on a platform: controllers on its legs or modes, steps along its axes, sines, its workspace."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.table import Table
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec, controller_spec, read_numbers
from ...control.platform_controller import LEGS, Forward, PlatformSpec, Smoothing
from ...loop.conditions import Conditions
from ...loop.platform.steps import AxisStep
from ...rigs.platform import AXES, Platform, load_platform
from ...rigs.platform.platform import PAYLOAD
from ..common.experiment import MOST_POINTS, read_conditions
from .platform_record import PlatformRecord, read_record

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


@dataclass(frozen=True)
class PlatformConfig:
    """An experiment on a platform; `f` [k] are the frequencies of its linear transfer, Hz. `source` is the file."""

    rig: Platform
    controllers: tuple[PlatformSpec, ...]
    steps: tuple[AxisStep, ...]
    f: np.ndarray
    sines: Sines
    workspace: Workspace
    variations: Mapping[str, Mapping[str, float]]
    record: PlatformRecord | None
    conditions: Conditions
    source: Mapping[str, Any]

    @property
    def delay(self) -> float:
        """Computing delay [s]."""
        return 0.0 if self.conditions.ideal else self.rig.legs[0].rig.computing_delay.value


def platform_config(top: Table, path: Path, rig: str | None) -> PlatformConfig:
    """The tables of an experiment on a platform; `rig` replaces the one it names. Raises InputError."""
    top.allow(*KEYS)
    platform = load_platform(rig) if rig else load_platform(top.text("rig"), path.parent)
    names = top.words("scenarios", "heave-10mm")
    tables = top.table("controllers")
    if not len(tables):
        raise top.complaint("controllers", "no controllers; add a table [controllers.NAME]")
    transfer = top.table("transfer", "low_hz", "high_hz", "points")
    low, high = transfer.positive("low_hz"), transfer.positive("high_hz")
    if not low < high < 0.5 / platform.period:
        raise transfer.complaint("high_hz", f"must be above low_hz and below {0.5 / platform.period:g} Hz")
    return PlatformConfig(
        platform,
        tuple(_controller(tables, name, platform) for name in tables),
        tuple(top.about("scenarios", lambda name=name: AxisStep.named(name)) for name in names),
        np.geomspace(low, high, transfer.count("points", 3, MOST_POINTS)),
        _sines(top.table("sines", "frequencies_hz", "amplitude"), platform),
        _workspace(top.table("workspace", "box", "speeds")),
        _variations(top.optional_table("variations")),
        read_record(top.table("record"), platform) if "record" in top else None,
        read_conditions(top),
        top.values,
    )


def _sines(table: Table, platform: Platform) -> Sines:
    frequencies = table.numbers("frequencies_hz", "[1, 5]")
    if min(frequencies) < 0.1 or max(frequencies) > 0.05 / platform.period:
        raise table.complaint("frequencies_hz", f"must be between 0.1 and {0.05 / platform.period:g} Hz")
    return Sines(frequencies, table.quantity("amplitude", Spec("m", 1e-6, 1.0, "amplitude at the joints")))


def _variations(table: Table) -> dict[str, dict[str, float]]:
    """Payloads by name: numbers that are others than the platform's."""
    parts = {name: table.table(name, *PAYLOAD) for name in table}
    return {name: {key: part.quantity(key, PAYLOAD[key]) for key in part} for name, part in parts.items()}


def _workspace(table: Table) -> Workspace:
    specs = {"box": (_LENGTH, _ANGLE), "speeds": (_SPEED, _TURNING)}
    parts = {}
    for key, (linear, angular) in specs.items():
        part = table.table(key, *AXES)
        parts[key] = np.array([part.quantity(axis, linear if i < 3 else angular) for i, axis in enumerate(AXES)])
    return Workspace(parts["box"], parts["speeds"])


def _controller(tables: Table, name: str, platform: Platform) -> PlatformSpec:
    """On every leg the controller of a table; or, with a list of `laws`, one on each mode."""
    table = tables.table(name)
    if "laws" not in table:
        own = table.replaced({key: entry for key, entry in table.values.items() if key != "smoothing"})
        spec = _checked(controller_spec(name, own), own, platform)
        return PlatformSpec(name, (spec,) * LEGS, smoothing=_smoothing(table))
    table.allow("laws", "smoothing", "command_map")
    laws: dict[int, tuple[ControllerSpec, Forward | None]] = {}
    for entry in table.tables("laws"):
        modes = entry.numbers("modes", "[1, 2]")
        own = entry.replaced({key: part for key, part in entry.values.items() if key not in ("modes", "forward")})
        spec = _checked(controller_spec(name, own), own, platform)
        forward = read_numbers(Forward, entry.table("forward")) if "forward" in entry else None
        for mode in modes:
            if mode not in range(1, LEGS + 1) or int(mode) in laws:
                raise entry.complaint("modes", f"each mode from 1, the slowest, to {LEGS} needs one law")
            laws[int(mode)] = spec, forward
    if len(laws) < LEGS:
        raise table.complaint("laws", f"each mode from 1, the slowest, to {LEGS} needs one law")
    ordered = [laws[i + 1] for i in range(LEGS)]
    forwards = tuple(forward for _, forward in ordered if forward)
    if len(forwards) not in (0, LEGS):
        raise table.complaint("laws", "give all laws a table forward, or none")
    command_map = _command_map(table, name) if "command_map" in table else None
    return PlatformSpec(name, tuple(spec for spec, _ in ordered), True, command_map, forwards, _smoothing(table))


def _smoothing(table: Table) -> Smoothing | None:
    return read_numbers(Smoothing, table.table("smoothing")) if "smoothing" in table else None


def _command_map(table: Table, name: str) -> ControllerSpec:
    """The map of the commands of the jacks: a compensator that maps a command."""
    part = table.table("command_map")
    spec = controller_spec(
        name, part.replaced({"use": "controllers.p:P", "gain": "1 1/m", "compensators": [part.values]})
    )
    return spec.compensators[0]


def _checked(spec: ControllerSpec, table: Table, platform: Platform) -> ControllerSpec:
    """A law of the position of a jack, with the signals that the legs measure."""
    law = spec.build(platform.period)
    if law.measures[0] != "position":
        raise table.complaint("use", f"controls the {law.measures[0]}; a platform's laws control the position")
    for signal in law.measures:
        if any(signal not in leg.rig.sensors for leg in platform.legs):
            raise table.complaint("use", f"needs the {signal}, which not all legs measure; declare a sensor")
    return spec
