"""How numbers and initial states follow an effect that is put in at a finite strength; and a fit by that alone.

A fit made its numbers do for an effect that its model lacks, so that the effect, put in at its true strength, harms at
first. Numbers and initial states therefore follow it by Gauss-Newton steps with the slopes of the fit without it (a
chord method: Ortega, Rheinboldt, Iterative Solution of Nonlinear Equations in Several Variables, 1970, sec. 7.1).

An effect on which a loop hunts has no useful tangent: windows are steep along it, though at the strengths that matter
it changes the errors but gently. Its own numbers are then fitted by secants, over a share of themselves.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from ..fit.determined import FreeParameter
from ..fit.free_parameters import Candidate, extend_parameters
from ..fit.initial_states import fit_states
from ..fit.model import Model
from ..fit.normal_equations import FIRST_DAMPING, accumulate, number_step, numbers_at, ranges, slopes_of, tangents_at
from ..fit.prior import prior_of
from ..fit.solver import Fit, with_slopes, without_slopes
from ..fit.windows import Windows
from .score import initial_states_with_effect

_STEPS = 4
_ENOUGH = 0.01  # relative fall of the squared errors below which no further step is made
_CLOSE = 1e-4  # and in a fit
_DAMPINGS = (FIRST_DAMPING, 0.1, 10.0)  # of a step, the first that does no harm
_SLOPES: WeakKeyDictionary[Fit, tuple[Windows, list[np.ndarray]]] = WeakKeyDictionary()
_SECANT = 0.2  # of a strength, or of a number that is searched by its logarithm; of half a range else


@dataclass(frozen=True, eq=False)
class Start:
    """A start of a refit: distances of the fit's numbers and then of the effects' [k], all parameters, initial
    states [windows, n] of the model without the effects, those with them and how far they are from where the others put
    them, and the errors of each group."""

    x: np.ndarray
    p: np.ndarray
    base_x0: np.ndarray
    further: np.ndarray
    x0: np.ndarray
    errors: Sequence[np.ndarray]

    @property
    def squares(self) -> float:
        """The sum of squared errors."""
        return sum(float(np.sum(part**2)) for part in self.errors)


class Follower:
    """Starts of `model`, which is that of a fit, `base`, with further effects: the `candidates`."""

    def __init__(self, base: Model, windows: Windows, fit: Fit, model: Model, candidates: Sequence[Candidate]) -> None:
        self._base, self._windows, self._fit, self._model = base, windows, fit, model
        self._own = tuple(number for candidate in candidates for number in candidate.free())
        self._offs = [number.off for candidate in candidates for number in candidate.effect.fitted]
        self._slopes = _slopes(base, windows, fit)
        self._p = extend_parameters(base.plant, fit.p, model.plant)

    @property
    def free(self) -> tuple[FreeParameter, ...]:
        """The numbers of the fit and those of the effects."""
        return (*self._fit.free, *self._own)

    def start(self, share: float = 1.0, steps: int = _STEPS) -> Start:
        """The start at a `share` of the candidates' strengths, followed by that many steps at most."""
        own = [_toward(f, off, share) for f, off in zip(self._own, self._offs, strict=True)]
        nothing = np.zeros((self._windows.count, self._model.plant.n))
        start = self._at(np.append(self._fit.x, own), self._fit.x0, nothing)
        for _ in range(steps):
            start, fall = self._ahead(start, self._slopes, len(self._fit.free))
            if fall < _ENOUGH:
                break
        return start

    def best(self, shares: Sequence[float]) -> tuple[Start, bool]:
        """The start at that of the `shares`, largest first, from which on less does worse, and whether it does no harm:
        leaves less than the fit without the effects."""
        before, best = float(self._fit.squares.sum()), self.start(shares[0])
        for share in shares[1:]:
            weaker = self.start(share)
            if best.squares < min(before, weaker.squares):
                break
            best = min(best, weaker, key=lambda start: start.squares)
        return best, best.squares < before

    def fit(self, start: Start, kappa: np.ndarray, rounds: int) -> Fit:
        """All numbers fitted from a start, those of the effects by secants; kappa [signals] of the noise.

        Initial states of the effects' own, which the fit without them knows nothing of, are fitted window by window
        between two descents.
        """
        start = self._descended(start, rounds)
        x0, _ = fit_states(self._model, self._windows, start.x0, start.p)
        start = self._descended(self._at(start.x, start.base_x0, start.further + x0 - start.x0), rounds)
        squares = np.empty(self._windows.count)
        for group, errors in zip(self._windows.groups, start.errors, strict=True):
            squares[group.which] = np.sum(errors**2, axis=(1, 2))
        place = start.x, start.p, start.x0, squares
        if not np.isfinite(start.squares):
            return without_slopes(self._windows, self.free, *place)
        slopes = self._with_secants(start)
        about = slopes, start.errors, start.base_x0, self._fit.x0
        tangents = tangents_at(self._base, self._windows, *about)
        return with_slopes(self._model, self._windows, self.free, place, tangents, kappa, prior_of(self.free))

    def _descended(self, start: Start, rounds: int) -> Start:
        for _ in range(rounds):
            start, fall = self._ahead(start, self._with_secants(start), len(self.free))
            if fall < _CLOSE:
                break
        return start

    def _ahead(self, start: Start, slopes: Sequence[np.ndarray], count: int) -> tuple[Start, float]:
        """The place after a step of the first `count` numbers, and the relative fall; or where it was, and none."""
        x, prior = start.x[:count], prior_of(self.free[:count])
        normal = accumulate(self._base, self._windows, slopes, start.errors, start.base_x0, self._fit.x0)
        for damping in _DAMPINGS if np.isfinite(start.squares) else ():
            dx0, dx = number_step(normal, x, prior.gradient(x), prior.matrix, prior.ends, damping)
            moved = np.append(np.clip(x + dx, *prior.ends), start.x[count:])
            ahead = self._at(moved, start.base_x0 + dx0 * self._base.plant.scale, start.further)
            if ahead.squares < start.squares:
                return ahead, 1 - ahead.squares / start.squares
        return start, 0.0

    def _with_secants(self, start: Start) -> list[np.ndarray]:
        """The slopes of the fit with those of the effects' numbers behind them."""
        columns = list(self._secants(start))
        return [
            np.concatenate([slope, *(column[g].reshape(*slope.shape[:2], 1) for column in columns)], axis=2)
            for g, slope in enumerate(self._slopes)
        ]

    def _secants(self, start: Start) -> Iterator[list[np.ndarray]]:
        """Changes of the errors per distance of each number of the effects."""
        first = len(self._fit.free)
        _, high, width = ranges(self._own)
        for j, (number, off) in enumerate(zip(self._own, self._offs, strict=True)):
            at = start.x[first + j]
            step = _SECANT * (abs(at - number.normalised(off)) if off is not None else min(1.0, width[j]))
            step = max(step, 1e-6 * width[j])
            step = step if at + step <= high[j] else -step
            moved = start.x.copy()
            moved[first + j] = at + step
            ahead = self._at(moved, start.base_x0, start.further).errors
            yield [np.nan_to_num((a - b) / step, posinf=0, neginf=0) for a, b in zip(ahead, start.errors, strict=True)]

    def _at(self, x: np.ndarray, base_x0: np.ndarray, further: np.ndarray) -> Start:
        p = numbers_at(self._model, self.free, x, self._p)
        x0 = initial_states_with_effect(self._model, self._base, self._windows, base_x0, p) + further
        return Start(x, p, base_x0, further, x0, self._model.errors(self._windows, x0, p))


def _slopes(base: Model, windows: Windows, fit: Fit) -> list[np.ndarray]:
    """Slopes at a fit, computed once for all effects that are put in beside it."""
    known = _SLOPES.get(fit)
    if known is None or known[0] is not windows:
        known = _SLOPES[fit] = windows, slopes_of(base, windows, fit.x0, fit.p, fit.free, fit.x)
    return known[1]


def _toward(free: FreeParameter, off: float | None, share: float) -> float:
    """The distance of a number that is `share` of the way from off to its start; a number without off stays."""
    return 0.0 if off is None else (1 - share) * free.normalised(off)
