"""Small CSV tables whose columns are known beforehand, and the frequency-response sheet, which is a record too."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.errors import InputError, nearest
from ..base.signals import SIGNALS, output_signal
from ..base.table import ConfigTable
from ..base.units import from_si, to_si
from .table import DataTable, open_table

_CELL = re.compile(r"(?P<name>[^\[\]]*?)\s*\[(?P<unit>[^\[\]]*)\]")
FEWEST = 2  # frequencies
_DECIBEL = "dB"


@dataclass(frozen=True, eq=False)
class FrequencySheet:
    """A frequency response as a datasheet gives it: sine of `amplitude` (SI of the input) at f [k] Hz, rising.

    `response` [k] is complex, SI of the output over SI of the input; where it is `relative`, as a gain in dB is, only
    its shape counts: it is 1 at the lowest frequency, as a response that is compared with it must be.
    """

    name: str
    input: str
    output: str
    amplitude: float
    f: np.ndarray
    response: np.ndarray
    relative: bool


def read_sheet(path: str | Path, amplitude: float | None, input: str, output: str) -> FrequencySheet:
    """Read `frequency [Hz],gain [dB],phase [deg]`, a sheet of one amplitude.

    A gain in dB is referred to the lowest frequency; any other unit is one of output over input, such as `gain [l/min]`
    for the flow of a command.

    Parameters
    ----------
    path
        The file.
    amplitude
        Amplitude of the input, SI; None where a column such as `amplitude [1]` has it.
    input
        Name of the input signal.
    output
        Name of the output signal.

    Returns
    -------
    The sheet, SI.

    Raises
    ------
    InputError
        With file, row and column.
    """
    path = Path(path)
    for name in (input, output):
        if name not in SIGNALS:
            raise InputError(f'{path}: unknown signal "{name}"; {nearest(name, SIGNALS)}')
    sheet = Columns(path)
    relative = sheet.unit("gain") == _DECIBEL
    f, response = _response(sheet, gain_unit(input, output))
    size = amplitude_stated(sheet, amplitude, SIGNALS[input].si)
    return FrequencySheet(path.stem, input, output, size, f, response / response[0] if relative else response, relative)


def read_response(path: str | Path, unit: str, si: str) -> tuple[np.ndarray, np.ndarray]:
    """f [k] in Hz and the complex response [k], output in `unit` over the input, of a sheet of any linear plant.

    Its gain is `[dB]` or `[1]`, and then in `unit` already, or a unit of the output that converts to `si` as `unit`
    does, that of the input after a stroke: `gain [mm/V]`. Raises InputError with file, row and column.
    """
    sheet = Columns(Path(path))
    written = sheet.unit("gain")
    f, response = _response(sheet, None)
    if written in (_DECIBEL, "1"):
        return f, response
    try:
        return f, response * float(to_si(1.0, written.partition("/")[0], si) / to_si(1.0, unit, si))
    except InputError as error:
        raise InputError(f'{path}: column "gain [{written}]": {error}; write dB, 1, or {unit} over the input') from None


def _response(sheet: "Columns", si: str | None) -> tuple[np.ndarray, np.ndarray]:
    """f and the response, its gain in the unit `si` where it is not in decibels."""
    f = sheet.values("frequency", "Hz")
    late = np.flatnonzero(np.diff(f, prepend=0.0) <= 0)
    if late.size:
        raise InputError(f"{sheet.where(late[0], 'frequency')}: frequencies must be above 0 and rise; sort the rows")
    if f.size < FEWEST:
        raise InputError(f"{sheet.path}: {f.size} rows; a sheet needs at least {FEWEST} frequencies")
    relative = sheet.unit("gain") == _DECIBEL
    with np.errstate(over="ignore"):
        gain = 10 ** (sheet.values("gain") / 20) if relative else sheet.values("gain", si)
    bad = np.flatnonzero(~((gain > 0) & np.isfinite(gain)))
    if bad.size:
        raise InputError(f"{sheet.where(bad[0], 'gain')}: must be above 0 and finite; a sign belongs into the phase")
    return f, gain * np.exp(1j * sheet.values("phase", "rad"))


def listed_sheet(entry: ConfigTable, folder: Path) -> FrequencySheet:
    """One of the `[[sheets]]` of a campaign file: file, input, output, amplitude (in the unit of the input: 1, mA,
    mm)."""
    entry.allow("file", "input", "output", "amplitude")
    file = entry.text("file")
    input, output = entry.word("input", SIGNALS, "command"), entry.word("output", SIGNALS, "flow")
    amplitude = None
    if "amplitude" in entry:
        amplitude = float(to_si(entry.positive("amplitude"), SIGNALS[input].unit, SIGNALS[input].si))
    return read_sheet(folder / file, amplitude, input, output)


def table_text(columns: Mapping[str, np.ndarray]) -> str:
    """CSV of signals, name -> [n] SI, in the units that people are shown, 10 digits."""
    cells = []
    for name, values in columns.items():
        signal = output_signal(name)
        shown = from_si(values, signal.unit, signal.si)
        cells.append([f"{value:.10g}" for value in shown.tolist()])
    header = ",".join(f"{name} [{output_signal(name).unit}]" for name in columns)
    return "\n".join([header, *(",".join(row) for row in zip(*cells, strict=True)), ""])


class Columns:
    """A CSV table with header cells `name [unit]`, every cell a finite number. Raises InputError with file and row."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.table: DataTable = open_table(path)
        self.cells = {}
        for cell in self.table.header:
            parts = _CELL.fullmatch(cell)
            name = parts["name"] if parts else cell
            if name in self.cells:
                raise InputError(f'{path}: two columns "{name}"; keep one')
            self.cells[name] = (cell, parts["unit"] if parts else None)

    def __contains__(self, name: str) -> bool:
        return name in self.cells

    def unit(self, name: str) -> str:
        """The unit that the header gives."""
        if name not in self.cells:
            raise InputError(f'{self.path}: no column "{name} [unit]"; {nearest(name, self.cells)}')
        cell, unit = self.cells[name]
        if unit is None:
            raise InputError(f'{self.path}: column "{cell}": no unit; write "{name} [unit]"')
        return unit

    def values(self, name: str, si: str | None = None, gaps: bool = False) -> np.ndarray:
        """A column [n], converted to the unit `si` where one is given; with `gaps` an empty cell is NaN."""
        unit = self.unit(name)
        values = self.table.read([self.cells[name][0]])[self.cells[name][0]]
        bad = np.flatnonzero(np.isinf(values) if gaps else ~np.isfinite(values))
        if bad.size:
            raise InputError(f"{self.where(int(bad[0]), name)}: empty or infinite; fill it in or remove the row")
        try:
            return values if si is None else to_si(values, unit, si)
        except InputError as error:
            raise InputError(f'{self.path}: column "{self.cells[name][0]}": {error}') from None

    def times(self) -> np.ndarray:
        """The column t [n] in s, which has to rise. Raises InputError."""
        t = self.values("t", "s")
        if len(t) < 2 or not np.all(np.diff(t) > 0):
            raise InputError(f"{self.path}: t must rise from row to row, over two rows or more; mend it")
        return t

    def where(self, index: int, name: str) -> str:
        """ "file: row N, column ..." for a message."""
        return f'{self.path}: row {self.table.rows[index]}, column "{self.cells[name][0]}"'


def gain_unit(input: str, output: str) -> str:
    """SI unit of a gain that is not in decibels."""
    below, above = SIGNALS[input].si, SIGNALS[output].si
    return above if below == "1" else f"({above})/({below})"


def amplitude_needed(sheet: Columns, given: float | str | None, si: str) -> None:
    """Raises InputError where no amplitude is `given`, nor a column of them."""
    if given is None and "amplitude" not in sheet:
        raise InputError(f'{sheet.path}: at which amplitude? State it, or add a column "amplitude [{si}]"')


def amplitude_stated(sheet: Columns, given: float | None, si: str) -> float:
    """The amplitude of a sheet, in the unit `si`, that is `given` or in a column. Raises InputError."""
    amplitude_needed(sheet, given, si)
    if given is not None and "amplitude" not in sheet:
        stated = np.array([given])
    else:
        stated = sheet.values("amplitude", si)
        other = np.flatnonzero(stated != stated[0])
        if other.size:
            raise InputError(f"{sheet.where(other[0], 'amplitude')}: another amplitude; make it a sheet of its own")
        if given is not None and abs(given - stated[0]) > 1e-6 * abs(given):
            raise InputError(f"{sheet.where(0, 'amplitude')}: {stated[0]:g} {si}, but {given:g} {si} was asked for")
    if not 0 < stated[0] < np.inf:
        raise InputError(f"{sheet.path}: amplitude {stated[0]:g} {si}: must be a positive number")
    return float(stated[0])
