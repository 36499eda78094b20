"""What a fit found of the numbers that a campaign's sessions have to themselves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.units import from_si
from ...rigs.number import Number
from ..fit.session_numbers import SessionNumber
from ..fit.solver import Fit
from ..trace.problem import EstimationProblem


@dataclass(frozen=True)
class SessionFit:
    """A number of a session after a fit, SI: the rig's own as fitted, what changes it, with its 95 % interval."""

    own: SessionNumber
    number: Number
    base: float
    change: float
    low: float
    high: float

    @property
    def value(self) -> float:
        """The number in the session, or after one step of a drift."""
        return self._after(self.change)

    @property
    def interval(self) -> tuple[float, float]:
        """The value's 95 % interval, where the rig's own number is as fitted."""
        return self._after(self.low), self._after(self.high)

    def _after(self, change: float) -> float:
        return float(self.own.values(np.array([self.base]), change, np.ones(1))[0])

    def __str__(self) -> str:
        """ "K3 0.983 times the rig's (95 % 0.981 to 0.985)"."""
        if self.own.is_factor:
            times = f"times with every {self.own.per}" if self.own.per else "times the rig's"
            return f"{self.number.name} {self.change:.4g} {times} (95 % {self.low:.4g} to {self.high:.4g})"
        change, low, high = (self._shown(end) - self._shown(0.0) for end in (self.change, self.low, self.high))
        step = f"{self.number.unit} with every {self.own.per}" if self.own.per else self.number.unit
        return f"{self.number.name} {change:+.3g} {step} (95 % {low:+.3g} to {high:+.3g})"

    def json(self) -> dict[str, Any]:
        """The entry in metrics.json: value in the session and what makes it, SI, [change, low, high] at 95 %."""
        kind = "factor" if self.own.is_factor else "shift"
        where = {"session": self.own.session, "number": f"{self.number.name} [{self.number.si}]"}
        where |= {"per": self.own.per} if self.own.per else {}
        return where | {"value": self.value, kind: [self.change, self.low, self.high]}

    def row(self) -> list[Any]:
        """Session, number and values, in the unit of the rig file."""
        values = [self._shown(value) for value in (self.base, self.value, *self.interval)]
        times = self.change if self.own.is_factor else None
        of = f"{self.own.session}, with every {self.own.per}" if self.own.per else self.own.session
        return [of, self.number.name, self.number.unit, *values, times]

    def _shown(self, value: float) -> float:
        return float(from_si(value, self.number.unit, self.number.si))


def session_fits(problem: EstimationProblem, fit: Fit) -> list[SessionFit]:
    """The numbers of sessions that a fit moved."""
    places = {free.name: index for index, free in enumerate(fit.free)}
    fits = []
    for own in (number for number in problem.sessions if number.fitted):
        base, change = (fit.free[k].value(float(fit.x[k])) for k in (places[own.number], places[own.name]))
        number = problem.rig.numbers[own.number]
        fits.append(SessionFit(own, number, base, change, *fit.interval(places[own.name])))
    return fits


def numbers_in_sessions(
    before: Mapping[str, Mapping[str, Number]], fits: Sequence[SessionFit], source: str
) -> dict[str, dict[str, Number]]:
    """The numbers of every session for a rig file: those fitted, and others as they were `before`; what drifts has the
    number that the first record had."""
    sessions = {name: dict(numbers) for name, numbers in before.items()}
    for each in (each for each in fits if not each.own.per):
        number = replace(
            each.number, value=each.value, source=f"fitted to {source}: {each}", interval=tuple(sorted(each.interval))
        )
        sessions.setdefault(each.own.session, {})[each.number.name] = number
    return sessions
