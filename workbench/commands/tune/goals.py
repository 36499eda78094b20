"""What a design has to reach: hard goals in their order, the cheap ones first, then the cost of what is wished for."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...loop.margins import STABLE, closed_poles
from ...loop.rig_variations import variation, with_delay
from ...loop.rows import LinearLoops, LoopSetup, judge, linear_loops, loop_setup
from ...loop.scenarios import Scenario
from .problem import TuneProblem

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
    """The goals of a search, on the rigs of its set."""

    def __init__(self, problem: TuneProblem) -> None:
        self.problem = problem
        delay = problem.conditions.delay(problem.controller, problem.rig)
        self.setups = {name: loop_setup(with_delay(variation(problem.rig, name), delay)) for name in problem.rigs}
        self.runs = [(name, scenario) for name in problem.rigs for scenario in problem.scenarios]

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
        controller = self._controller(values)
        yield "numbers that make a controller", 0.0 if controller else 1.0
        assert controller is not None
        yield "all poles inside the unit circle on every rig, at null and moving", self._growth(controller)
        loops = {"nominal": linear_loops(controller, self.setups["nominal"])}
        yield f"Ms <= {MS:g} and gain margin >= {GAIN_MARGIN_DB:g} dB on the nominal rig", _margins(loops["nominal"])
        for name, scenario in self.runs:
            setup = self.setups[name]
            if name not in loops:
                loops[name] = linear_loops(controller, setup)
            rows.append(judge(controller, scenario, setup, loops[name], self.problem.conditions.noise)[1])
            goal = f"{scenario.name} on {name} without a trip, oscillating in the end by less than {RESIDUAL:.1%}"
            yield goal, _unrest(rows[-1])

    def _controller(self, values: Mapping[str, float]) -> ControllerSpec | None:
        try:
            controller = self.problem.design(values)
            controller.build(self.problem.rig.period.value)
        except InputError:
            return None
        return controller

    def _growth(self, controller: ControllerSpec) -> float:
        """How fast the unstable loops grow [1/s], summed over rigs and points."""
        return sum(_growth(controller, setup) for setup in self.setups.values())

    def _cost(self, rows: list[dict[str, Any]]) -> float:
        """Weighted: the worst of the rigs of each number, its mean over the scenarios."""
        scenarios = {scenario.name: scenario for scenario in self.problem.scenarios}
        worst: dict[str, dict[str, float]] = {name: {} for name in scenarios}
        for line in rows:
            numbers = worst[line["scenario"]]
            for key, value in _weighed(line, scenarios[line["scenario"]]).items():
                numbers[key] = max(value, numbers.get(key, 0.0))
        weights = self.problem.weights
        return float(sum(weight * np.mean([each[key] for each in worst.values()]) for key, weight in weights.items()))


def _growth(controller: ControllerSpec, setup: LoopSetup) -> float:
    period = setup.rig.period.value
    law = controller.build(period)
    sizes = [np.abs(closed_poles(plant, law)).max() for plant in (setup.null_plant, setup.moving_plant)]
    return float(sum(max(0.0, size - STABLE) / period for size in sizes))


def _margins(loops: LinearLoops) -> float:
    """How far Ms and gain margin are from what is asked for, in parts of it, summed over both points."""
    miss = 0.0
    for loop in (loops.null, loops.moving):
        miss += max(0.0, loop.ms / MS - 1) if loop.ms is not None else 1.0
        miss += max(0.0, 1 - loop.gain_margin_db / GAIN_MARGIN_DB) if loop.gain_margin_db is not None else 0.0
    return miss


def _unrest(line: dict[str, Any]) -> float:
    if line["tripped"] is not None:
        return _TRIPPED
    return max(0.0, (line["residual_oscillation"] or 0.0) / RESIDUAL - 1)


def _weighed(line: dict[str, Any], scenario: Scenario) -> dict[str, float]:
    """What the weights weigh: settling [s] (all of the run where it never settles), IAE over the step [s], or over the
    peak that a load alone pushes, overshoot [%], Ms. A sine has no settling and no overshoot."""
    never = scenario.duration if scenario.arrives is not None else 0.0
    settling = line["settling_s"] if line["settling_s"] is not None else never
    return {
        "settling": settling,
        "iae": line["iae"] / abs(scenario.size or line["peak_deviation"]),
        "overshoot": line["overshoot_percent"] or 0.0,
        "robustness": line["ms"],
    }
