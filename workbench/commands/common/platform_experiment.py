"""What experiments on a platform share: the platform, controllers on its legs or modes, steps, how they are judged."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.table import ConfigTable
from ...control.controller_spec import ControllerSpec, controller_spec, read_numbers
from ...control.platform_controller import LEGS, Forward, PlatformSpec, Smoothing
from ...loop.platform.steps import AxisStep
from ...loop.rig_variations import Conditions
from ...rigs.platform import Platform, load_platform
from .experiment import borrowed_controllers, read_conditions


@dataclass(frozen=True, kw_only=True)
class PlatformExperiment:
    """Controllers on a platform, and the conditions under which they are judged. `source` is the file, with the tables
    of controllers that it borrows."""

    rig: Platform
    controllers: tuple[PlatformSpec, ...]
    conditions: Conditions
    source: Mapping[str, Any]

    @property
    def delay(self) -> float:
        """Computing delay [s]."""
        return 0.0 if self.conditions.ideal else self.rig.legs[0].rig.computing_delay.value


def platform_experiment(top: ConfigTable, path: Path, rig: str | None, borrows: bool = False) -> PlatformExperiment:
    """Of the file at a path, which has its controllers or `borrows` them; `rig` replaces the platform that it names.
    Raises InputError with file and key."""
    platform = load_platform(rig) if rig else load_platform(top.text("rig"), path.parent)
    if not borrows:
        own, source = platform_controllers(top, platform), top.values
    else:
        tables = borrowed_controllers(top.table("from"), path.parent)
        own = tuple(platform_controller(name, table, platform) for name, table in tables.items())
        source = {**top.values, "controllers": {name: table.values for name, table in tables.items()}}
    return PlatformExperiment(rig=platform, controllers=own, conditions=read_conditions(top), source=source)


def read_steps(top: ConfigTable) -> tuple[AxisStep, ...]:
    """The steps along axes under the key scenarios. Raises InputError with file and key."""
    names = top.words("scenarios", "heave-10mm")
    return tuple(top.about("scenarios", lambda name=name: AxisStep.named(name)) for name in names)


def platform_controllers(top: ConfigTable, platform: Platform) -> tuple[PlatformSpec, ...]:
    """Those of the tables [controllers.NAME]. Raises InputError with file and key."""
    tables = top.table("controllers")
    if not len(tables):
        raise top.complaint("controllers", "no controllers; add a table [controllers.NAME]")
    return tuple(platform_controller(name, tables.table(name), platform) for name in tables)


def platform_controller(name: str, table: ConfigTable, platform: Platform) -> PlatformSpec:
    """On every leg the controller of a table; or, with a list of `laws`, one on each mode. Raises InputError with file
    and key."""
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


def _smoothing(table: ConfigTable) -> Smoothing | None:
    return read_numbers(Smoothing, table.table("smoothing")) if "smoothing" in table else None


def _command_map(table: ConfigTable, name: str) -> ControllerSpec:
    """The map of the commands of the jacks: a compensator that maps a command."""
    part = table.table("command_map")
    spec = controller_spec(
        name, part.replaced({"use": "controllers.p:P", "gain": "1 1/m", "compensators": [part.values]})
    )
    return spec.compensators[0]


def _checked(spec: ControllerSpec, table: ConfigTable, platform: Platform) -> ControllerSpec:
    """A law of the position of a jack, with the signals that the legs measure."""
    law = spec.build(platform.period)
    if law.measures[0] != "position":
        raise table.complaint("use", f"controls the {law.measures[0]}; a platform's laws control the position")
    for signal in law.measures:
        if any(signal not in leg.rig.sensors for leg in platform.legs):
            raise table.complaint("use", f"needs the {signal}, which not all legs measure; declare a sensor")
    return spec
