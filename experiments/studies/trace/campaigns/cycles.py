"""Cycles of a pump-controlled rig: out, hold, back, half the way, each record at its own setting of the load."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from workbench.base.units import from_si
from workbench.records.excitation import Excitation

PERIOD = 20e-3  # s from row to row
AMPLITUDES = (12.5e-3, 25e-3, 37.5e-3, 50e-3)  # m
RAMP = 12.5e-3  # m/s
REST, HOLDS, SECONDS = 2.4, (4.0, 3.0, 2.0), 27.0  # s, the longest that a cycle takes, all in all
LIGHT, MIDDLE, HEAVY = (0.0,), (20e5, 30e5), (40e5, 50e5)  # Pa
ROLES = {"train": (1, 2), "select": (3,), "heldout": (4,)}
STATIC = 2.0  # s, of each train record


def cycles(seed: np.random.Generator) -> tuple[Excitation, ...]:
    """Four cycles, the first of them of full amplitude."""
    drawn = [AMPLITUDES[-1], *seed.choice(AMPLITUDES, 3).tolist()]
    return tuple(_cycle(_name(number), amplitude) for number, amplitude in enumerate(drawn, 1))


def load_settings(seed: np.random.Generator) -> dict[str, float]:
    """Set pressure [Pa] of each cycle: light and heavy in any order to fit, middle to select, heavy to judge."""
    train = [(LIGHT, HEAVY)[place] for place in seed.permutation(2)]
    bands = (*train, MIDDLE, HEAVY)
    return {_name(number): float(seed.choice(band)) for number, band in enumerate(bands, 1)}


def cycle_roles(settings: Mapping[str, float]) -> dict[str, list[dict[str, Any]]]:
    """[records] of campaign.toml."""
    roles: dict[str, list[dict[str, Any]]] = {
        "static": [{"file": _file(number), "to": STATIC} for number in ROLES["train"]]
    }
    for role, numbers in ROLES.items():
        roles[role] = [
            {"file": _file(number), "load_setting": f"{from_si(settings[_name(number)], 'bar', 'Pa'):g} bar"}
            for number in numbers
        ]
    return roles


def _cycle(name: str, amplitude: float) -> Excitation:
    """Rest, ramps between holds, rest; its command adds nothing to the loop."""
    goals = (0.0, amplitude, amplitude, 0.0, 0.0, amplitude / 2, amplitude / 2, 0.0)
    way = np.abs(np.diff(goals)) / RAMP
    lasts = np.where(way > 0, way, (0, HOLDS[0], 0, HOLDS[1], 0, HOLDS[2], 0))
    at = REST + np.concatenate(([0.0], np.cumsum(lasts)))
    rows = round(SECONDS / PERIOD)
    reference = np.interp(PERIOD * np.arange(rows), at, goals)
    return Excitation(name, PERIOD, reference, np.zeros(rows))


def _name(number: int) -> str:
    return f"cycle{number}"


def _file(number: int) -> str:
    return f"{_name(number)}.csv.gz"
