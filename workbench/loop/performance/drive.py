"""What a drive file takes of a rig: opening of the lands, flow, power, heat; an accumulator beside a pump; and which
valves and pumps of a catalogue would do it, the smallest first, and by what the others fail.

A file has corners that no jack follows: what is above a band is taken off. The force is the motion's, by the linear
model of what is carried.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...rigs.rig import Rig
from ..capability import capability
from .bounds import Demand, demanded, drawn_power, oil_speed
from .carried import carried_by_jack

MODE_SHARE = 0.5  # of the mode of mass and oil: the band of a drive file where none is given
PRECHARGE, ADIABATIC = 0.9, 1.4  # of the lowest pressure; exponent of nitrogen's pressure over its volume
_FADE, _GRID, _SLOWEST = 1.5, 400, 1e-3  # of the band, where nothing is left; frequencies of the load; Hz
RATED = 70e5  # Pa: the drop at which valves are compared


@dataclass(frozen=True, eq=False)
class Demands:
    """Over a drive file at a control period: position [k] m, speeds [k] m/s of the piston and of the oil, and pressure
    force [k] N."""

    rig: Rig
    t: np.ndarray
    position: np.ndarray
    speed: np.ndarray
    oil: np.ndarray
    force: np.ndarray

    @cached_property
    def lands(self) -> Demand:
        """Opening and chamber pressures."""
        return demanded(self.rig, self.oil, self.force)

    @cached_property
    def power(self) -> np.ndarray:
        """Out of the supply [k] W."""
        return drawn_power(self.rig, self.oil, self.force)

    @property
    def flow(self) -> np.ndarray:
        """Out of the supply [k] m^3/s."""
        return self.power / self.rig["Ps"]

    @property
    def heat(self) -> float:
        """Mean power [W] that stays in the oil: what the supply gave, less what the piston passed on."""
        return float(np.mean(self.power) - np.mean(self.force * self.speed))


def demands(rig: Rig, position: np.ndarray, band: float | None = None) -> Demands:
    """What positions [k] m from mid stroke at the control period demand, up to a band [Hz], else half of the mode's.

    The file is taken as played forth and back, so that it may end elsewhere than it begins.
    """
    band = MODE_SHARE * capability(rig).mode if band is None else band
    there = np.concatenate((position, position[::-1]))
    f = np.fft.rfftfreq(there.size, rig.period.value)
    lines = np.fft.rfft(there) * np.clip((_FADE * band - f) / ((_FADE - 1) * band), 0.0, 1.0)
    grid = np.geomspace(_SLOWEST, max(_FADE * band, f[-1]), _GRID)
    load = carried_by_jack(rig, grid)
    at = np.log(np.maximum(f, _SLOWEST))
    real, imaginary = (np.interp(at, np.log(grid), part) for part in (np.real(load.force), np.imag(load.force)))
    force = real + 1j * (f > 0) * imaginary
    turn = 2j * np.pi * f
    oil = oil_speed(rig, turn, force, turn * force)

    def back(values: np.ndarray) -> np.ndarray:
        return np.fft.irfft(values, there.size)[: position.size]

    t = np.arange(position.size) * rig.period.value
    return Demands(rig, t, back(lines), back(lines * turn), back(lines * oil), load.held + back(lines * force))


def lacking(flow: np.ndarray, period: float, pump: float) -> float | None:
    """The most oil [m^3] that a flow [k] m^3/s, played again and again, takes beyond what a pump has given; None where
    the pump gives less than the mean."""
    if pump < float(flow.mean()):
        return None
    missing = most = 0.0
    for each in ((np.tile(flow, 2) - pump) * period).tolist():
        missing = max(0.0, missing + each)
        most = max(most, missing)
    return most


def accumulator(oil: float, supply: float, sag: float) -> float:
    """Gas volume [m^3] that gives `oil` [m^3] while the supply [Pa] falls by a share `sag`, by the adiabatic gas law:
    p V^1.4 stays as it is, from a precharge of 0.9 of the lowest pressure (Rabie, Fluid Power Engineering, 2009,
    ch. 7)."""
    low = (1 - sag) * supply
    first = PRECHARGE * low
    return oil / ((first / low) ** (1 / ADIABATIC) - (first / supply) ** (1 / ADIABATIC))


@dataclass(frozen=True)
class CatalogueValve:
    """A valve: `flow` [m^3/s] fully open at a `drop` [Pa] over both lands, and the `bandwidth` [Hz] of a lag."""

    name: str
    flow: float
    drop: float
    bandwidth: float
    price: float | None = None
    order: str = ""

    @property
    def rated(self) -> float:
        """Flow [m^3/s] at 70 bar."""
        return self.flow * float(np.sqrt(RATED / self.drop))


@dataclass(frozen=True)
class CataloguePump:
    """A pump of a `flow` [m^3/s] at the rig's supply pressure."""

    name: str
    flow: float
    price: float | None = None
    order: str = ""


@dataclass(frozen=True)
class Choice:
    """An entry held against a drive file: by which limit it `fails`, "" where it suffices, and how much of that limit
    it takes; `accumulator` [m^3] of gas that a pump needs, 0 where it needs none."""

    entry: CatalogueValve | CataloguePump
    fails: str
    used: float
    accumulator: float | None = None


def valve_choices(need: Demands, valves: Sequence[CatalogueValve]) -> list[Choice]:
    """Each valve in place of each of the rig's, from the smallest on.

    A valve opens by its lag: its command is the opening and, over 2 pi times the bandwidth, the opening's rate.
    """
    return [_valve(need, valve) for valve in sorted(valves, key=lambda each: (each.rated, each.bandwidth))]


def _valve(need: Demands, valve: CatalogueValve) -> Choice:
    rig, opening = need.rig, need.lands.opening
    if not np.all(np.isfinite(opening)):
        return Choice(valve, "supply", np.inf)
    asked = np.sign(need.oil) * opening * rig["K3"] * rig["z3max"] * np.sqrt(RATED / 2) / valve.rated
    most = float(np.abs(asked).max())
    if most > 1:
        return Choice(valve, "flow", most)
    rate = np.gradient(asked, rig.period.value) / (2 * np.pi * valve.bandwidth)
    led = float(np.abs(asked + rate).max())
    return Choice(valve, "bandwidth" if led > 1 else "", led)


def pump_choices(need: Demands, pumps: Sequence[CataloguePump], sag: float) -> list[Choice]:
    """Each pump with the accumulator that it needs, the supply falling by a share `sag` at most, from the smallest."""
    mean, period = float(need.flow.mean()), need.rig.period.value
    choices = []
    for pump in sorted(pumps, key=lambda each: each.flow):
        oil = lacking(need.flow, period, pump.flow)
        gas = None if oil is None else accumulator(oil, need.rig["Ps"], sag)
        choices.append(Choice(pump, "mean flow" if oil is None else "", mean / pump.flow, gas))
    return choices


def smallest(choices: Sequence[Choice]) -> Choice | None:
    """The first that suffices."""
    return next((choice for choice in choices if not choice.fails), None)
