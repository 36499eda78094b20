"""What a search leaves of sheets: where in frequency, and which linear element behind the model takes it away."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records.sheet_points import SheetPoints
from ..trace import rule
from .element import ELEMENTS, Element
from .fit import Errors, SheetFit, fitted_sheets
from .model import errors, offsets
from .problem import SheetProblem

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
    """Where deviations [k, 2] (dB, degrees) of each sheet are plain."""
    found = []
    for sheet, deviation in zip(sheets, deviations, strict=True):
        size = np.where(np.abs(np.nan_to_num(deviation)) > _PLAIN * np.array(sigma), np.abs(deviation), 0.0)
        plain = np.concatenate(([False], size.any(axis=1), [False]))
        starts, ends = np.flatnonzero(plain[1:] > plain[:-1]), np.flatnonzero(plain[1:] < plain[:-1])
        for first, end in zip(starts, ends, strict=True):
            gain, phase = size[first:end].max(axis=0).tolist()
            found.append(Band(sheet.name, float(sheet.f[first]), float(sheet.f[end - 1]), gain, phase))
    return found


def with_element(problem: SheetProblem, before: SheetFit) -> SheetFit | None:
    """The fit with the element that Schwarz's criterion takes, all numbers free; None where none is worth it."""
    n = problem.samples
    able = [
        (float(fit.fit.squares.sum()) + len(element.numbers) * float(np.log(n)), fit)
        for element in ELEMENTS
        for fit in [_fitted(problem, before, element)]
        if _worth(before, fit, len(element.numbers), n)
    ]
    return min(able, key=lambda pair: pair[0])[1] if able else None


def _worth(before: SheetFit, after: SheetFit, numbers: int, n: int) -> bool:
    fall = rule.bic_fall(float(before.fit.squares.sum()), float(after.fit.squares.sum()), numbers, n)
    real = rule.passes(before.squares, after.squares, fall, _KAPPA, len(ELEMENTS))
    return real and rule.explained(before.squares, after.squares, n) >= _WORTH


def _fitted(problem: SheetProblem, before: SheetFit, element: Element) -> SheetFit:
    """The fit with an element, from the numbers of it that do best beside the fit as it is."""
    own = before.model.deviations(problem.train, before.fit.p[None])
    trials = element.trials()
    changed = [a + b for a, b in zip(own, element.deviations(problem.train, trials), strict=True)]
    left = np.sum(errors(changed, offsets(problem.train, changed), problem.sigma) ** 2, axis=(1, 2))
    values = trials[int(np.argmin(left))]
    free = tuple(number.free for number in element.numbers)
    start = [number.normalised(float(value)) for number, value in zip(free, values, strict=True)]
    model = problem.model(before.model.effects, element)
    whole = Errors(problem, model, (*before.fit.free, *free), np.append(before.fit.p, values))
    return fitted_sheets(problem, whole, np.append(before.fit.x, start))
