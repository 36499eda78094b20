"""A platform's balance closed by its payload's numbers and by what joints and payload show."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...rigs.platform import AXES, Platform
from .balance import NUMBERS, WrenchBalance, balance
from .candidates import Recorded, WrenchCandidate, with_joint
from .fitted import FITTED, JUDGED, WrenchProblem, over_noise, solved, whitened
from .lines import lines

PAYLOAD = len(NUMBERS)
_NORMAL = 1.96
_MOVES, _STILL = 4, 1e-4  # times that a joint is moved and the balance taken anew; m
Place = tuple[int, str]


@dataclass(frozen=True, eq=False)
class Closed:
    """A balance with `effects`: their numbers after those of the payload are `numbers` [10 + k] with their covariance,
    and the squares left over the noise by role. `platform` has its joints where they were `moved` [3] m to; `linear`
    [10] are numbers of a payload near which columns are taken; `base` is the same platform without the last effect,
    where that is known."""

    problem: WrenchProblem
    platform: Platform
    effects: tuple[WrenchCandidate, ...]
    linear: np.ndarray
    moved: Mapping[Place, np.ndarray] = field(default_factory=dict)
    base: "Closed | None" = None

    @cached_property
    def balances(self) -> Mapping[str, tuple[WrenchBalance, ...]]:
        """The balances of the platform with its joints where they were found, by role."""
        if self.base is not None:
            return self.base.balances
        if self.platform is self.problem.platform:
            return self.problem.declared
        return {
            role: tuple(
                balance(self.platform, legs, there.moved.pose)
                for legs, there in zip(self.problem.signals[role], self.problem.declared[role], strict=True)
            )
            for role in (FITTED, JUDGED)
        }

    @cached_property
    def rows(self) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
        """By role the columns [rows, 10 + k] and wrenches [rows] of all lines, over their noise."""
        noise, period = self.problem.noise, self.problem.period
        if self.base is None:
            further = self.effects
            rows = {role: whitened(self.balances[role], noise, period) for role in (FITTED, JUDGED)}
        else:
            rows, further = self.base.rows, self.effects[-1:]
        own = {role: [self._columns(effect, role) for effect in further] for role in rows}
        return {role: (np.hstack((columns, *own[role])), wrench) for role, (columns, wrench) in rows.items()}

    def _columns(self, effect: WrenchCandidate, role: str) -> np.ndarray:
        """What a unit of each number of an effect leaves over [rows, k]."""
        pairs = zip(self.problem.signals[role], self.balances[role], strict=True)
        recorded = [Recorded(self.platform, legs, each, self.linear) for legs, each in pairs]
        noise, period = self.problem.noise, self.problem.period
        return np.concatenate([over_noise(effect.columns(each), noise, period) for each in recorded])

    @cached_property
    def _solved(self) -> tuple[np.ndarray, np.ndarray]:
        return solved(*self.rows[FITTED])

    @property
    def numbers(self) -> np.ndarray:
        """Linear ones of the payload, then of effects; of a place what is left to move."""
        return self._solved[0]

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the numbers; what is left of the fitted records beyond the noise widens it."""
        return max(1.0, self.squares[FITTED] / self.samples(FITTED)) * self._solved[1]

    @cached_property
    def squares(self) -> Mapping[str, float]:
        """Sum of squares of what is left over the noise, by role."""
        return {role: float(np.sum(self.left(role) ** 2)) for role in self.rows}

    def left(self, role: str) -> np.ndarray:
        """What is left over the noise, row by row."""
        columns, wrench = self.rows[role]
        return wrench - columns @ self.numbers

    def samples(self, role: str) -> int:
        """Real ones."""
        return self.rows[role][1].size

    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Spectrum of the first held-out record: frequencies [k] Hz and what is left over the noise, chi2 of all six
        components [k]."""
        f = lines(self.balances[JUDGED][0].wrench, self.problem.period)[0]
        parts = self.left(JUDGED)[: 2 * f.size * len(AXES)].reshape(2, f.size, len(AXES))
        return f, np.mean(parts**2, axis=(0, 2))

    @property
    def chi2(self) -> float:
        """The chi2 of the held-out records."""
        return self.squares[JUDGED] / self.samples(JUDGED)

    def given(self, effect: WrenchCandidate) -> "Closed":
        """With one more effect. A joint is moved until the balance of the moved platform asks for no more."""
        found = replace(self, linear=self.numbers[:PAYLOAD], effects=(*self.effects, effect), base=self)
        if effect.place is None:
            return found
        for _ in range(_MOVES):
            step = found.numbers[-3:]
            if np.abs(step).max() < _STILL:
                break
            moved = found.moved.get(effect.place, np.zeros(3)) + step
            found = replace(
                found, platform=with_joint(found.platform, *effect.place, step), base=None,
                linear=found.numbers[:PAYLOAD], moved={**found.moved, effect.place: moved},
            )  # fmt: skip
        return found

    def parameters(self, effect: WrenchCandidate) -> dict[str, tuple[float, float | None, float | None]]:
        """Numbers of one of its effects, SI, with the ends of their 95 % intervals where these are known."""
        widths = [other.width for other in self.effects]
        first = PAYLOAD + sum(widths[: self.effects.index(effect)])
        own = slice(first, first + effect.width)
        values, halves = self.numbers[own], _NORMAL * np.sqrt(np.diag(self.covariance)[own])
        if effect.place is not None:
            values = values + self.moved.get(effect.place, 0.0)
        ends = [
            (float(value), float(value - half), float(value + half)) for value, half in zip(values, halves, strict=True)
        ]
        return dict(zip(effect.units, [*ends, *((value, None, None) for value in effect.fixed)], strict=True))
