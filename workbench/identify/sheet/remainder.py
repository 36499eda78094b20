"""What a search leaves of sheets: where in frequency, and which linear element behind the model takes it away."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records.sheet_points import SheetPoints
from ..trace import rule
from .element import ELEMENTS, Element
from .fit import Errors, SheetFit, fitted_sheets
from .model import errors, in_half_a_turn, offsets
from .problem import SheetProblem
from .shortlist import Rest

_PLAIN = 2.0  # times what a sheet is known to: an error that is plain to see
_KAPPA = 1.0
_WORTH = 0.1  # of what is left: an element that takes away less is left out


@dataclass(frozen=True)
class Band:
    """Neighbouring frequencies of a sheet, low to high [Hz], at which the error is plain: its largest gain [dB] and
    phase [deg]; 0 where it is none, or none is stated."""

    sheet: str
    low: float
    high: float
    gain: float
    phase: float


def bands(sheets: Sequence[SheetPoints], deviations: Sequence[np.ndarray], sigma: tuple[float, float]) -> list[Band]:
    """The bands in which deviations [k, 2] (dB, degrees) of each sheet are plain; parts of one name are one sheet."""
    found = []
    for name in dict.fromkeys(sheet.name for sheet in sheets):
        own = [place for place, sheet in enumerate(sheets) if sheet.name == name]
        f = np.concatenate([sheets[place].f for place in own])
        order = np.argsort(f)
        f, deviation = f[order], np.concatenate([deviations[place] for place in own])[order]
        size = np.where(np.abs(np.nan_to_num(deviation)) > _PLAIN * np.array(sigma), np.abs(deviation), 0.0)
        plain = np.concatenate(([False], size.any(axis=1), [False]))
        starts, ends = np.flatnonzero(plain[1:] > plain[:-1]), np.flatnonzero(plain[1:] < plain[:-1])
        for first, end in zip(starts, ends, strict=True):
            gain, phase = size[first:end].max(axis=0).tolist()
            found.append(Band(name, float(f[first]), float(f[end - 1]), gain, phase))
    return found


def with_element(problem: SheetProblem, before: SheetFit) -> SheetFit | None:
    """The fit with the element that Schwarz's criterion takes, all numbers free; None where none is worth it.

    What is behind a model only filters its response, which is known: elements are compared without a simulation, the
    model's own numbers following by their slopes. The one that is taken is then fitted with the model itself.
    """
    n = problem.samples
    told = [fitted_behind(each) for each in behind_elements(problem, before)]
    able = [fit for fit in told if _worth(before, fit, n)]
    for best in sorted(able, key=lambda fit: float(fit.fit.squares.sum()) + _numbers(fit) * float(np.log(n))):
        fit = fitted_sheets(problem, Errors(problem, best.model, best.fit.free, best.fit.p), best.fit.x)
        if _worth(before, fit, n):
            return fit
    return None


def _numbers(fit: SheetFit) -> int:
    return len(fit.model.element.numbers) if fit.model.element else 0


def _worth(before: SheetFit, after: SheetFit, n: int) -> bool:
    fall = rule.bic_fall(float(before.fit.squares.sum()), float(after.fit.squares.sum()), _numbers(after), n)
    real = not rule.accident(before.squares, after.squares, fall, _KAPPA, len(ELEMENTS))
    return real and rule.explained(before.squares, after.squares, n) >= _WORTH


@dataclass(frozen=True, eq=False)
class Behind(Errors):
    """The errors of a finished fit with an `element` behind it: the model's own numbers follow by their slopes.

    `own` are its deviations [1, k, 2] of every sheet at distances `x`, `along` the slopes [points, 2, x] there.
    """

    element: Element
    own: Sequence[np.ndarray]
    x: np.ndarray
    along: np.ndarray

    def at(self, x: np.ndarray) -> np.ndarray:
        """Errors over sigma [lanes, points, 2] at distances x [lanes, free]."""
        sheets, there = self.problem.train, len(self.x)
        added = self.element.deviations(sheets, self.parameters(x)[:, -len(self.element.numbers) :])
        changed = [in_half_a_turn(a + b) for a, b in zip(self.own, added, strict=True)]
        behind = errors(changed, offsets(sheets, changed), self.problem.sigma)
        return behind + np.einsum("psi,li->lps", self.along, x[:, :there] - self.x)


def behind_elements(problem: SheetProblem, before: SheetFit) -> list[Behind]:
    """The errors with every element behind a fit."""
    model, fit = before.model, before.fit
    own = model.deviations(problem.train, fit.p[None])
    here = errors(own, offsets(problem.train, own), problem.sigma)[0]
    along = Errors(problem, model, fit.free, fit.p).slopes(fit.x, here)
    behind = []
    for element in ELEMENTS:
        free = (*fit.free, *(number.free for number in element.numbers))
        p = np.append(fit.p, [number.tried[0] for number in element.numbers])
        behind.append(Behind(problem, model.behind(element), free, p, element, own, fit.x, along))
    return behind


def fitted_behind(behind: Behind) -> SheetFit:
    """The fit of the errors with an element, from the numbers of it that leave least when the model's follow."""
    there = len(behind.x)
    tried = [
        [free.normalised(float(value)) for free, value in zip(behind.free[there:], values, strict=True)]
        for values in behind.element.trials()
    ]
    starts = np.hstack((np.tile(behind.x, (len(tried), 1)), np.array(tried)))
    rest = Rest(behind.free[:there], behind.along)
    left = [float(np.sum(rest(change) ** 2)) for change in behind.at(starts)]
    return fitted_sheets(behind.problem, behind, starts[int(np.argmin(left))])
