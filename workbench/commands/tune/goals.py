"""What a design has to reach: hard goals over the envelope in their order, the cheap ones first, then the cost."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...control.protocol import Controller
from ...loop.envelope import Envelope, envelope
from ...loop.hard_goals import SECONDS, Goal, linear_goals, motion_goals, noisy_steps
from ...loop.rig_variations import with_delay
from ...loop.scenarios import Scenario
from ...loop.sensors import settling_band
from .problem import TuneProblem

_KEPT = 24  # of the drawn plants: the worst for the start


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
    """A design that was tried: its numbers by name, each in its unit, and how far it came."""

    number: int
    values: Mapping[str, float]
    verdict: Verdict


class Goals:
    """The goals of a search, over the envelope of the rigs of its set."""

    def __init__(self, problem: TuneProblem) -> None:
        self.problem = problem
        self.envelope = tuning_envelope(problem)

    def judge(self, values: Mapping[str, float]) -> Verdict:
        """A design by its searched numbers, each in its unit: goal after goal up to the first that it misses."""
        spec, met = self._controller(values), []
        left = self._count
        if spec is None:
            return Verdict(left, "numbers that make a controller", 1.0, None, [])
        controller = spec.build(self.problem.rig.period.value)
        for goal in self._goals(controller):
            left -= 1
            met.append(goal)
            if goal.miss > 0:
                return Verdict(left + 1, goal.name, goal.miss, None, met)
        return Verdict(0, None, 0.0, self._cost(controller, met), met)

    @property
    def _count(self) -> int:
        """How many goals there are, a controller included."""
        steps = [scenario for scenario in self.problem.scenarios if scenario.size]
        overshoots = len(steps) if np.isfinite(self.problem.limits.overshoot_percent) else 0
        return 6 + 2 * len(self.problem.scenarios) + overshoots

    def _goals(self, controller: Controller) -> Iterator[Goal]:
        problem = self.problem
        yield from linear_goals(self.envelope, controller, problem.limits)
        yield from motion_goals(self.envelope, controller, problem.scenarios, problem.limits)

    def _controller(self, values: Mapping[str, float]) -> ControllerSpec | None:
        try:
            controller = self.problem.design(values)
            controller.build(self.problem.rig.period.value)
        except InputError:
            return None
        return controller

    def _cost(self, controller: Controller, goals: Sequence[Goal]) -> float:
        """Weighted: each number half by the nominal rig's worst, half by that of every plant; mean over scenarios."""
        ms = max(goal.value for goal in goals if goal.name.startswith("Ms") and goal.value is not None)
        numbers = [self._numbers(controller, scenario) for scenario in self.problem.scenarios]
        cost = self.problem.weights.get("robustness", 0.0) * ms
        for key in numbers[0].keys() & self.problem.weights.keys():
            cost += self.problem.weights[key] * float(np.mean([each[key] for each in numbers]))
        return cost

    def _numbers(self, controller: Controller, scenario: Scenario) -> dict[str, float]:
        """Settling [s], all of the run where it never settles; IAE over the step, or over the band of a load [s];
        overshoot [%]."""
        lanes = noisy_steps(self.envelope, controller, scenario, self.problem.conditions.noise)
        size = abs(scenario.size) or settling_band(self.problem.rig, scenario.signal, 0.0)
        nominal = self.envelope.are_nominal(lanes[0].names)
        return {
            "settling": _worst([np.nan_to_num(each.settling, nan=SECONDS) for each in lanes], nominal),
            "iae": _worst([each.iae / size for each in lanes], nominal),
            "overshoot": _worst([each.overshoot for each in lanes], nominal),
        }


def tuning_envelope(problem: TuneProblem) -> Envelope:
    """The rigs of a search over the stroke, with the computing delay; of the drawn plants the worst for the start."""
    delay = problem.conditions.delay(problem.controller, problem.rig)
    rigs = {name: with_delay(rig, delay) for name, rig in problem.rigs.items()}
    whole = envelope(rigs, problem.positions, problem.factors, problem.seed)
    return whole.hardened(problem.controller.build(problem.rig.period.value), problem.scenarios[0], _KEPT)


def _worst(values: Sequence[np.ndarray], nominal: np.ndarray) -> float:
    """Half by the nominal rig's worst, half by that of all lanes; the first values are of varied plants."""
    return float(np.max(values[0][nominal]) + max(np.max(each) for each in values)) / 2
