"""What a design has to reach: hard goals in their order, the cheap ones first, then the cost of what is wished for."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...loop.margins import STABLE, closed_poles
from ...loop.rig_variations import variation
from ...loop.rows import LinearLoops, LoopSetup, linear_loops, loop_setup, play, row
from ...loop.scenarios import Scenario
from .config import TuneConfig

MS, GAIN_MARGIN_DB = 2.0, 6.0
RESIDUAL = 0.002  # of the step, peak to peak over the last 0.3 s
_TRIPPED = 1e3  # how far a loop misses that trips: as one that oscillates by twice the step


@dataclass(frozen=True)
class Verdict:
    """How far a design came: `left` hard goals unmet, the first of them `missed` by `miss` (0: met, else above 0).

    A design that misses none has a `cost`, and a row for each scenario on each rig.
    """

    left: int
    missed: str | None
    miss: float
    cost: float | None
    rows: list[dict[str, Any]]

    @property
    def score(self) -> float:
        """What the search makes small: no design that misses a goal is better than one that reaches it."""
        fraction = self.miss if self.cost is None else self.cost
        return self.left + fraction / (1 + fraction)


@dataclass(frozen=True)
class Trial:
    """A design that was tried: its numbers by name, each in its unit, and how far it came."""

    number: int
    values: Mapping[str, float]
    verdict: Verdict


class Goals:
    """The goals of a tune experiment, on the rigs of its set."""

    def __init__(self, config: TuneConfig) -> None:
        self.config = config
        self.benches = {name: loop_setup(variation(config.start.rig, name)) for name in config.rigs}
        self.runs = [(name, wanted) for name in config.rigs for wanted in config.start.scenarios]

    def judge(self, values: Mapping[str, float]) -> Verdict:
        """A design by its searched numbers, each in its unit: goal after goal up to the first that it misses."""
        rows: list[dict[str, Any]] = []
        left = 3 + len(self.runs)
        for name, miss in self._goals(values, rows):
            if miss > 0:
                return Verdict(left, name, miss, None, [])
            left -= 1
        return Verdict(0, None, 0.0, self._cost(rows), rows)

    def _goals(self, values: Mapping[str, float], rows: list[dict[str, Any]]) -> Iterator[tuple[str, float]]:
        """The goals' names, and how far the design misses each; the rows of the runs go to `rows`."""
        chosen = self._made(values)
        yield "numbers that make a controller", 0.0 if chosen else 1.0
        assert chosen is not None
        yield "all poles inside the unit circle on every rig, at null and moving", self._growth(chosen)
        loops = {"nominal": linear_loops(chosen, self.benches["nominal"])}
        yield f"Ms <= {MS:g} and gain margin >= {GAIN_MARGIN_DB:g} dB on the nominal rig", _margins(loops["nominal"])
        for name, wanted in self.runs:
            on = self.benches[name]
            if name not in loops:
                loops[name] = linear_loops(chosen, on)
            rows.append(row(chosen, wanted, on, play(chosen, wanted, on), loops[name]))
            goal = f"{wanted.name} on {name} without a trip, oscillating in the end by less than {RESIDUAL:.1%}"
            yield goal, _unrest(rows[-1])

    def _made(self, values: Mapping[str, float]) -> ControllerSpec | None:
        try:
            chosen = self.config.design(values)
            chosen.build(self.config.start.rig.period.value)
        except InputError:
            return None
        return chosen

    def _growth(self, chosen: ControllerSpec) -> float:
        """How fast the unstable loops grow [1/s], summed over rigs and points."""
        return sum(_growth(chosen, on) for on in self.benches.values())

    def _cost(self, rows: list[dict[str, Any]]) -> float:
        """Weighted: the worst of the rigs of each number, its mean over the scenarios."""
        scenarios = {wanted.name: wanted for wanted in self.config.start.scenarios}
        worst: dict[str, dict[str, float]] = {name: {} for name in scenarios}
        for one in rows:
            there = worst[one["scenario"]]
            for key, value in _wishes(one, scenarios[one["scenario"]]).items():
                there[key] = max(value, there.get(key, 0.0))
        weights = self.config.weights
        return float(sum(weight * np.mean([one[key] for one in worst.values()]) for key, weight in weights.items()))


def _growth(chosen: ControllerSpec, on: LoopSetup) -> float:
    period = on.rig.period.value
    controller, plant = chosen.build(period), on.engine.plant
    points = (on.null_smooth, on.moving)
    sizes = [np.abs(closed_poles(plant, point, controller, period, on.smooth)).max() for point in points]
    return float(sum(max(0.0, size - STABLE) / period for size in sizes))


def _margins(pair: LinearLoops) -> float:
    """How far Ms and gain margin are from what is asked for, in parts of it, summed over both points."""
    far = 0.0
    for loop in (pair.null, pair.moving):
        far += max(0.0, loop.ms / MS - 1) if loop.ms is not None else 1.0
        far += max(0.0, 1 - loop.gain_margin_db / GAIN_MARGIN_DB) if loop.gain_margin_db is not None else 0.0
    return far


def _unrest(one: dict[str, Any]) -> float:
    if one["tripped"] is not None:
        return _TRIPPED
    return max(0.0, (one["residual_oscillation"] or 0.0) / RESIDUAL - 1)


def _wishes(one: dict[str, Any], wanted: Scenario) -> dict[str, float]:
    """What the weights weigh: settling [s] (all of the run where it never settles), IAE over the step [s], overshoot
    [%], Ms. A sine has no settling and no overshoot."""
    never = wanted.duration if wanted.arrives is not None else 0.0
    settling = one["settling_s"] if one["settling_s"] is not None else never
    return {
        "settling": settling,
        "iae": one["iae"] / wanted.size,
        "overshoot": one["overshoot_percent"] or 0.0,
        "robustness": one["ms"],
    }
