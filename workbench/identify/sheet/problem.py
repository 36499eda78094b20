"""What a trace of frequency-response sheets works on: points to fit, and points that judge.

Every third frequency of a sheet judges, or whole sheets that are named; it is looked at once, when all is decided.
Where models are compared, points of the others in turn are predicted by the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError, check_known
from ...plant.effects import Effect
from ...records.sheet_points import SheetPoints
from ...rigs.rig import Rig
from ..fit.determined import FreeParameter
from ..fit.free_parameters import uncertain
from .model import SheetModel, SheetRig, bench_of

SIGMA = (0.2, 2.0)  # dB, degrees: a curve that is read off a printed sheet
FEWEST = 12  # gains and phases of sheets from which some are held out; of fewer all are fitted, and judge in turn
_EVERY = 3
_BLOCKS = 4
_THIN = 10


@dataclass(frozen=True, eq=False)
class SheetProblem:
    """Sheets of one rig by role, what they are known to (`sigma`: dB, degrees) and what they were measured on.

    Without `heldout` there are too few points for it.
    """

    rig: Rig
    source: str
    bench: SheetRig
    train: tuple[SheetPoints, ...]
    heldout: tuple[SheetPoints, ...]
    sigma: tuple[float, float]

    @property
    def sheets(self) -> tuple[SheetPoints, ...]:
        """All of them, by role."""
        return (*self.train, *self.heldout)

    @property
    def samples(self) -> int:
        """Gains and phases that are fitted, less what fixes the gain of a relative sheet."""
        return _samples(self.train)

    @property
    def blocks(self) -> np.ndarray:
        """The block [points] of each fitted frequency: neighbours are in different ones."""
        count = sum(sheet.f.size for sheet in self.train)
        return np.concatenate([np.arange(s.f.size) % min(_BLOCKS, count) for s in self.train])

    def thinned(self) -> "SheetProblem":
        """With every second of the fitted frequencies, where there are enough of them for scores."""
        if max(sheet.f.size for sheet in self.train) < _THIN:
            return self
        return replace(self, train=tuple(at_rows(sheet, slice(None, None, 2)) for sheet in self.train))

    def model(self, effects: Sequence[Effect] = ()) -> SheetModel:
        """The rig with effects, where the sheets were measured."""
        return SheetModel(self.bench, effects, self.train[0].output)

    def uncertain(self, model: SheetModel) -> tuple[FreeParameter, ...]:
        """The numbers of the rig that have bounds and act there."""
        there = model.depends_on()
        try:
            return tuple(free for free in uncertain(self.rig) if free.name in there)
        except InputError:  # no number has bounds: then none is fitted
            return ()


def sheet_problem(
    rig: Rig,
    source: str,
    sheets: Sequence[SheetPoints],
    sigma: tuple[float, float] = SIGMA,
    heldout: Sequence[str] = (),
) -> SheetProblem:
    """Sheets of one pair of signals by role; `heldout` are names of sheets that judge. Raises InputError."""
    names = [sheet.name for sheet in sheets]
    check_known("--heldout", heldout, names, "sheet")
    bench = bench_of(rig, sheets[0].input, sheets[0].output)
    if heldout:
        judges = tuple(sheet for sheet in sheets if sheet.name in heldout)
        train = tuple(sheet for sheet in sheets if sheet.name not in heldout)
        if not train:
            raise InputError("--heldout names every sheet; leave one to be fitted")
        return SheetProblem(rig, source, bench, train, judges, sigma)
    if sum(sheet.stated for sheet in sheets) < FEWEST:
        return SheetProblem(rig, source, bench, tuple(sheets), (), sigma)
    train, judges = (tuple(_some(sheet, judging) for sheet in sheets) for judging in (False, True))
    return SheetProblem(rig, source, bench, train, judges, sigma)


def _samples(sheets: Sequence[SheetPoints]) -> int:
    fixed = sum(sheet.relative and bool(np.isfinite(sheet.gain).any()) for sheet in sheets)
    return sum(sheet.stated for sheet in sheets) - fixed


def _some(sheet: SheetPoints, judging: bool) -> SheetPoints:
    """The frequencies of a sheet that judge (the third, the sixth ...) or the others."""
    return at_rows(sheet, (np.arange(sheet.f.size) % _EVERY == _EVERY - 1) == judging)


def at_rows(sheet: SheetPoints, rows: np.ndarray | slice) -> SheetPoints:
    """Some frequencies of a sheet."""
    return replace(sheet, f=sheet.f[rows], gain=sheet.gain[rows], phase=sheet.phase[rows])
