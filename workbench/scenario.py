"""The standard scenarios of a loop, by name."""

from dataclasses import dataclass

from .errors import InputError, nearest


@dataclass(frozen=True)
class Scenario:
    """A step of the controlled signal: its size (SI) and how long the loop is watched [s]."""

    name: str
    signal: str
    step: float
    duration: float


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario("position-1mm", "position", 1e-3, 3.0),
        Scenario("position-10mm", "position", 10e-3, 3.0),
        Scenario("position-100mm", "position", 100e-3, 4.0),
    )
}


def scenario(name: str, where: str) -> Scenario:
    """A scenario by name; raises InputError, opened by `where`, for an unknown one."""
    if name not in SCENARIOS:
        raise InputError(f'{where}: no scenario "{name}"; {nearest(name, SCENARIOS)}')
    return SCENARIOS[name]
