"""What a design has to reach: hard goals over the envelope in their order, the cheap ones first, then the cost."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...control.protocol import Controller
from ..envelope import Envelope, envelope, steps
from ..hard_goals import Goal, hardest, linear_goals, motion_goals
from ..rig_variations import with_delay
from ..scenarios import Scenario
from ..sensors import settling_band
from .problem import TuneProblem

_HARDEST = 4  # of the drawn plants, of each kind
Plants = tuple[int, ...]  # some of the drawn plants, by number


@dataclass(frozen=True)
class Verdict:
    """How far a design came: `left` hard goals unmet, the first of them `missed` by `miss` (0: met, else above 0).

    A design that misses none has a `cost`. `goals`: those that were looked at, by how much each is met and where the
    worst lies.
    """

    left: int
    missed: str | None
    miss: float
    cost: float | None
    goals: list[Goal]

    @property
    def score(self) -> float:
        """What the search makes small: no design that misses a goal is better than one that reaches it."""
        fraction = self.miss if self.cost is None else self.cost
        return self.left + fraction / (1 + fraction)


@dataclass(frozen=True)
class Trial:
    """A design that was tried: its numbers by name, each in its unit, and how far it came.

    `drawn`: on how many of the drawn plants. They become more while a search goes on, and none is let go.
    """

    number: int
    values: Mapping[str, float]
    verdict: Verdict
    drawn: int


class Goals:
    """The goals of a search, over the envelope of the rigs of its set."""

    def __init__(self, problem: TuneProblem) -> None:
        self.problem = problem
        self.envelope = tuning_envelope(problem)
        self._with_drawn = lru_cache(1)(self.envelope.with_drawn)

    def judge(self, values: Mapping[str, float], drawn: Plants = ()) -> Verdict:
        """A design by its searched numbers, each in its unit: goal after goal up to the first that it misses.

        `drawn`: the drawn plants that count.
        """
        spec, met = self._controller(values), []
        left = self._count
        if spec is None:
            return Verdict(left, "numbers that make a controller", 1.0, None, [])
        envelope, controller = self._with_drawn(drawn), spec.build(self.problem.rig.period.value)
        for goal in self._goals(envelope, controller):
            left -= 1
            met.append(goal)
            if goal.miss > 0:
                return Verdict(left + 1, goal.name, goal.miss, None, met)
        return Verdict(0, None, 0.0, self._cost(envelope, controller, met), met)

    def hardest(self, values: Mapping[str, float]) -> list[list[int]]:
        """The drawn plants that are hardest for a design, by kind; none for numbers that make no controller."""
        spec = self._controller(values)
        if spec is None:
            return []
        controller = spec.build(self.problem.rig.period.value)
        return hardest(self.envelope, controller, self.problem.scenarios, _HARDEST, self.problem.limits)

    @property
    def _count(self) -> int:
        """How many goals there are, a controller included."""
        limits, scenarios = self.problem.limits, self.problem.scenarios
        overshoots = isfinite(limits.overshoot_percent) * sum(bool(each.size) for each in scenarios)
        loads = isfinite(limits.load_left) * sum(bool(each.load and not each.size) for each in scenarios)
        held = 2 * sum(each.moves_alone for each in scenarios)
        return 6 + 2 * len(scenarios) + overshoots + loads + held

    def _goals(self, envelope: Envelope, controller: Controller) -> Iterator[Goal]:
        problem = self.problem
        yield from linear_goals(envelope, controller, problem.limits)
        yield from motion_goals(envelope, controller, problem.scenarios, problem.limits)

    def _controller(self, values: Mapping[str, float]) -> ControllerSpec | None:
        try:
            controller = self.problem.design(values)
            controller.build(self.problem.rig.period.value)
        except InputError:
            return None
        return controller

    def _cost(self, envelope: Envelope, controller: Controller, goals: Sequence[Goal]) -> float:
        """Weighted: each number half by the nominal rig's worst, half by that of every plant; mean of scenarios."""
        ms = max(goal.value for goal in goals if goal.metric == "ms" and goal.value is not None)
        numbers = [self._numbers(envelope, controller, scenario) for scenario in self.problem.scenarios]
        cost = self.problem.weights.get("ms", 0.0) * ms
        for key, weight in self.problem.weights.items():
            if values := [each[key] for each in numbers if key in each]:
                cost += weight * float(np.mean(values))
        return cost

    def _numbers(self, envelope: Envelope, controller: Controller, scenario: Scenario) -> dict[str, float]:
        """The metrics of a cost: IAE over the step, or over the settling band of a load [s]; of a step settling [s],
        all of the run where it never settles, and overshoot [%]. The IAE of a load is finite where a loop without
        integral action never makes up for it."""
        seconds, moves = self.problem.limits.seconds, self.problem.limits.moves
        noise = self.problem.conditions.noise
        noisy = steps(envelope.played(controller), controller, scenario, noise, seconds, moves)
        size = abs(scenario.size) or settling_band(self.problem.rig, scenario.signal, 0.0)
        nominal = envelope.are_nominal(noisy.names)
        numbers = {"iae": _worst(noisy.iae / size, nominal)}
        if scenario.size:
            numbers["settling_s"] = _worst(np.nan_to_num(noisy.settling, nan=seconds), nominal)
            numbers["overshoot_percent"] = _worst(noisy.overshoot, nominal)
        return numbers


def tuning_envelope(problem: TuneProblem) -> Envelope:
    """The rigs of a search over the stroke, with the computing delay, and all drawn plants."""
    delay = problem.conditions.delay(problem.controller, problem.rig)
    rigs = {name: with_delay(rig, delay) for name, rig in problem.rigs.items()}
    return envelope(rigs, problem.positions, problem.factors, problem.seed)


def _worst(values: np.ndarray, nominal: np.ndarray) -> float:
    """Half by the nominal rig's worst, half by that of all lanes."""
    return float(np.max(values[nominal]) + np.max(values)) / 2
