"""Which valves and pumps of a catalogue would do a drive file, the smallest first, and by what the others fail."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .drive import Demands, accumulator, lacking

RATED = 70e5  # Pa: the drop at which valves are compared


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
