"""What a further record adds to a campaign: cosines of pairs of effects, and intervals of numbers, now and after it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..fit.solver import UNSEEN, Fit
from .information import EffectInformation, cosines, effects_alone, sharpened

ALIKE = 0.7  # cosine from which an effect does half of what the other does to the errors
_LEAST = 0.01  # fall of a cosine, or of an interval over its range, that is worth a record
_MOST = 0.8  # of what the best record tells apart, of a pair: a record that tells as much is as good
_NEAR = 1.25  # times the interval that the best record leaves


@dataclass(frozen=True)
class Pair:
    """Two effects, by place and name: the cosine now and after each record, and the information that tells them apart
    (squared errors over sigma that the wrong one leaves, at least), now under ""."""

    places: tuple[int, int]
    names: tuple[str, str]
    cosine: float
    after: Mapping[str, float]
    apart: Mapping[str, float]

    def helpful(self, worth: Mapping[str, float]) -> list[str]:
        """The records that split them: first those that do about as far as any, of most worth first, then the others,
        the furthest first."""
        falls = {name: 1 - cosine**2 for name, cosine in self.after.items() if self.falls(cosine)}
        far = [name for name, share in falls.items() if share >= _MOST * max(falls.values())]
        others = sorted(falls.keys() - set(far), key=lambda name: -falls[name])
        return sorted(far, key=lambda name: -worth[name]) + others

    def falls(self, cosine: float) -> bool:
        """Whether a cosine is below that of now, by more than is not worth a record."""
        return cosine < self.cosine - _LEAST


@dataclass(frozen=True)
class UnseenNumber:
    """A number that the records do not tell: its 95 % interval over its range, now and after each record."""

    place: int
    name: str
    share: float
    after: Mapping[str, float]

    def best(self, worth: Mapping[str, float]) -> str | None:
        """The record of most worth that leaves about the shortest interval; None where none helps."""
        falls = {name: share for name, share in self.after.items() if share < self.share - _LEAST}
        near = [name for name, share in falls.items() if share <= _NEAR * min(falls.values())]
        return max(near, key=lambda name: worth[name], default=None)


def not_simulated(effects: EffectInformation, now: np.ndarray) -> list[str]:
    """The effects that no window bears at the strength that they would be compared at."""
    own = np.diag(now)[len(effects.model_fit.fit.free) :]
    return [each.effect.name for each, value in zip(effects.candidates, own, strict=True) if np.isnan(value)]


def pairs(effects: EffectInformation, now: np.ndarray, added: Mapping[str, np.ndarray]) -> list[Pair]:
    """Every two effects that look alike now, most first."""
    fit, names = effects.model_fit.fit, [candidate.effect.name for candidate in effects.candidates]
    alone = {"": effects_alone(now, fit)} | {name: effects_alone(now + more, fit) for name, more in added.items()}
    likeness = {name: cosines(products) for name, products in alone.items()}
    alike = []
    for i, j in combinations(range(len(names)), 2):
        if likeness[""][i, j] >= ALIKE:
            after = {name: float(cosine[i, j]) for name, cosine in likeness.items() if np.isfinite(cosine[i, j])}
            apart = {name: (1 - after[name] ** 2) * min(alone[name][i, i], alone[name][j, j]) for name in after}
            alike.append(Pair((i, j), (names[i], names[j]), after.pop(""), after, apart))
    return sorted(alike, key=lambda pair: -pair.cosine)


def unseen_numbers(fit: Fit, added: Mapping[str, np.ndarray], kappa: float) -> list[UnseenNumber]:
    """Every number whose 95 % interval leaves it anywhere in its range."""
    after = {name: _shares(sharpened(fit, more, kappa)) for name, more in added.items()}
    return [
        UnseenNumber(place, free.name, share, {name: shares[place] for name, shares in after.items()})
        for place, (free, share) in enumerate(zip(fit.free, _shares(fit), strict=True))
        if share >= UNSEEN
    ]


def worth(record: str, alike: Sequence[Pair], unseen: Sequence[UnseenNumber], fit: Fit, sharper: Fit) -> float:
    """Information of a record [nats]: on which effect of each pair it is, and on the numbers that are not told."""
    split = sum(np.log((1 + pair.apart.get(record, pair.apart[""])) / (1 + pair.apart[""])) for pair in alike)
    places = [number.place for number in unseen]
    volumes = [np.linalg.slogdet(each.covariance[np.ix_(places, places)])[1] for each in (fit, sharper)]
    return 0.5 * float(split + volumes[0] - volumes[1])


def _shares(fit: Fit) -> list[float]:
    """Interval over range of each number."""
    ends = [fit.interval(index) for index in range(len(fit.free))]
    return [(high - low) / (free.high - free.low) for free, (low, high) in zip(fit.free, ends, strict=True)]
