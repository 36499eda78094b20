"""What a further record adds to a campaign: cosines of pairs of effects, and intervals of numbers, now and after it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...identify.fit.solver import Fit
from ...identify.trace.foresight import Foresight, cosines, effects_alone, sharpened
from ..common.fit_result import UNSEEN

ALIKE = 0.7  # cosine from which an effect does half of what the other does to the errors
_LEAST = 0.01  # fall of a cosine, or of an interval over its range, that is worth a record
_ALL = 1e-6  # of one less the square of a cosine: two that are the same


@dataclass(frozen=True)
class Question:
    """A pair of effects or a number, with how little is known `now` (cosine, or interval over the range) and `after`
    each record, by name; `places` in the effects or numbers."""

    names: tuple[str, ...]
    places: tuple[int, ...]
    now: float
    after: Mapping[str, float]

    @property
    def best(self) -> str | None:
        """The record that leaves least open; None where none helps."""
        name = min(self.after, key=lambda each: self.after[each], default=None)
        return name if name is not None and self.after[name] < self.now - _LEAST else None


def pairs(asked: Foresight, now: np.ndarray, added: Mapping[str, np.ndarray]) -> list[Question]:
    """Every two effects that look alike now, most first."""
    fit, names = asked.model_fit.fit, [candidate.effect.name for candidate in asked.candidates]
    before = cosines(effects_alone(now, fit))
    after = {name: cosines(effects_alone(now + more, fit)) for name, more in added.items()}
    questions = [
        Question((names[i], names[j]), (i, j), float(before[i, j]), _finite({n: c[i, j] for n, c in after.items()}))
        for i, j in combinations(range(len(names)), 2)
        if before[i, j] >= ALIKE
    ]
    return sorted(questions, key=lambda question: -question.now)


def numbers(fit: Fit, added: Mapping[str, np.ndarray], kappa: float) -> list[Question]:
    """Every number whose 95 % interval leaves it anywhere in its range."""
    after = {name: _shares(sharpened(fit, more, kappa)) for name, more in added.items()}
    return [
        Question((free.name,), (place,), share, _finite({n: shares[place] for n, shares in after.items()}))
        for place, (free, share) in enumerate(zip(fit.free, _shares(fit), strict=True))
        if share >= UNSEEN
    ]


def worth(record: str, alike: Sequence[Question], unseen: Sequence[Question], fit: Fit, sharper: Fit) -> float:
    """Information of a record [nats]: on which effect of each pair it is, and on the numbers that are not told."""
    split = sum(_apart(question.after.get(record, question.now)) - _apart(question.now) for question in alike)
    places = [question.places[0] for question in unseen]
    volumes = [np.linalg.slogdet(each.covariance[np.ix_(places, places)])[1] for each in (fit, sharper)]
    return 0.5 * float(split + volumes[0] - volumes[1])


def _apart(cosine: float) -> float:
    return float(np.log(max(1 - cosine**2, _ALL)))


def _shares(fit: Fit) -> list[float]:
    """Interval over range of each number."""
    ends = [fit.interval(index) for index in range(len(fit.free))]
    return [(high - low) / (free.high - free.low) for free, (low, high) in zip(fit.free, ends, strict=True)]


def _finite(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items() if np.isfinite(value)}
