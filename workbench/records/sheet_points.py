"""A maker's curve as data: gain and phase at some frequencies, of which either may be missing at any of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.gain_phase import gain_db
from ..base.signals import SIGNALS
from .frequency_sheet import Columns, amplitude_stated, gain_unit

_DECIBEL = "dB"


@dataclass(frozen=True, eq=False)
class SheetPoints:
    """Response of `output` to sines of `amplitude` (SI of the input) at f [k] Hz, rising.

    `gain` [k] in dB of SI of the output over SI of the input, or, where it is `relative`, up to a constant; `phase` [k]
    in degrees. NaN where the sheet has none.
    """

    name: str
    input: str
    output: str
    amplitude: float
    f: np.ndarray
    gain: np.ndarray
    phase: np.ndarray
    relative: bool

    @property
    def values(self) -> np.ndarray:
        """Gain and phase [k, 2]."""
        return np.column_stack((self.gain, self.phase))

    @property
    def stated(self) -> int:
        """Number of gains and phases that are there."""
        return int(np.isfinite(self.values).sum())


def read_points(path: str | Path, amplitude: float | None, input: str, output: str) -> SheetPoints:
    """Read `frequency [Hz],gain [dB],phase [deg]`, a sheet of one amplitude, in which cells may be empty.

    Gain and amplitude as `read_sheet` takes them; the column of gain or that of phase may be missing. Raises
    InputError with file, row and column.
    """
    sheet = Columns(Path(path))
    f = sheet.values("frequency", "Hz")
    late = np.flatnonzero(np.diff(f, prepend=0.0) <= 0)
    if late.size:
        raise InputError(f"{sheet.where(late[0], 'frequency')}: frequencies must be above 0 and rise; sort the rows")
    if "gain" not in sheet and "phase" not in sheet:
        raise InputError(f'{path}: neither "gain [dB]" nor "phase [deg]"; a sheet has one of them at least')
    relative = "gain" not in sheet or sheet.unit("gain") == _DECIBEL
    nothing = np.full(f.size, np.nan)
    gain = _gain(sheet, relative, input, output) if "gain" in sheet else nothing
    phase = np.degrees(sheet.values("phase", "rad", gaps=True)) if "phase" in sheet else nothing
    size = amplitude_stated(sheet, amplitude, SIGNALS[input].si)
    points = SheetPoints(Path(path).stem, input, output, size, f, gain, phase, relative)
    if not points.stated:
        raise InputError(f"{path}: no gain and no phase in any row; fill some in")
    return points


def named_apart(sheets: Sequence[SheetPoints]) -> None:
    """Raises InputError for two sheets of one name."""
    names = [sheet.name for sheet in sheets]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f'two sheets "{name}"; rename one file')


def _gain(sheet: Columns, relative: bool, input: str, output: str) -> np.ndarray:
    """Gains [k] in dB, NaN where a cell is empty."""
    if relative:
        return sheet.values("gain", gaps=True)
    gain = sheet.values("gain", gain_unit(input, output), gaps=True)
    bad = np.flatnonzero(gain <= 0)
    if bad.size:
        raise InputError(f"{sheet.where(bad[0], 'gain')}: must be above 0; a sign belongs into the phase")
    return gain_db(gain)
