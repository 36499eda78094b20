"""Which column is which signal: header cells `name [unit]` and the campaign's [signals] mapping."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.signals import DRIVING, SIGNALS
from ..base.units import converts, to_si
from .table import cell_name

HELD, LINEAR = "held", "linear"
"""How a signal goes between its samples: as a drive holds its command, or on a straight line."""
_MOST_NAMED = 20  # columns in a message
_CELL = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")


@dataclass(frozen=True)
class ColumnMap:
    """How a column becomes a signal, where its header does not say so by itself.

    column  header cell, with or without its ` [unit]`, or a variable's name; None: the signal's own name
    unit    unit of the numbers in the column; None: the one in the header
    scale   where `unit` fits the signal, a plain factor after conversion to SI (-1 turns a sign); where it does not
            (a transducer's V, or no unit at all), the number itself is multiplied: scale is SI of the signal per `unit`
    clip    (low, high) in the numbers of the column: samples at or beyond a limit are not compared
    to      unit of scale * number + offset, whatever the unit of the column; None: as under `scale`
    offset  what is added after `scale`, in `to`, or SI where that is absent
    period  of t alone: the time [s] from row to row of a file without a clock
    between  HELD or LINEAR, between samples that are further apart than the rows: empty cells are filled so; where
            `import` filled the column in the other way, the one beside it is taken
    """

    column: str | None = None
    unit: str | None = None
    scale: float | None = None
    clip: tuple[float, float] | None = None
    to: str | None = None
    offset: float = 0.0
    period: float | None = None
    between: str | None = None


@dataclass(frozen=True)
class Column:
    """A column that was found: its header cell, the unit of its numbers, and `scale` to `offset` as in ColumnMap.

    unit: None where it does not fit the signal, so that `scale` alone converts.
    """

    cell: str
    unit: str | None
    scale: float
    clip: tuple[float, float] | None
    to: str | None
    offset: float
    between: str | None = None

    def to_si(self, numbers: np.ndarray, si: str) -> np.ndarray:
        """Numbers of the column [n] in the SI unit of its signal."""
        if self.to is not None:
            return to_si(self.scale * numbers + self.offset, self.to, si)
        return (numbers if self.unit is None else to_si(numbers, self.unit, si)) * self.scale + self.offset


def choose(
    path: Path, header: Sequence[str], mapping: Mapping[str, ColumnMap], unused: Collection[str] = ()
) -> tuple[dict[str, Column], list[str]]:
    """The column of each signal but the `unused`, and the header cells that nothing uses, quoted for a note.

    Raises InputError where t or command is missing, a column is there twice, or a unit is missing, unknown or misfits.
    """
    places: dict[str, str] = {}
    for name in SIGNALS:
        if name in unused:
            continue
        title = cell_name(mapping.get(name, ColumnMap()).column or name)
        cells = [cell for cell in header if title in (cell, _split(cell)[0])]
        if name == "t" and mapping.get(name, ColumnMap()).period is not None:
            continue
        if len(cells) > 1:
            raise InputError(f'{path}: columns {_listed(cells)} are all "{title}"; keep one or map it in [signals]')
        if cells:
            filled = beside(cells[0], mapping.get(name, ColumnMap()).between or "")
            places[name] = filled if filled in header else cells[0]
    _require(path, header, places, mapping)
    columns = {name: _column(path, name, cell, mapping.get(name, ColumnMap())) for name, cell in places.items()}
    used = set(places.values())
    other_ways = {beside(cell, way) for cell in header for way in (HELD, LINEAR)}
    left = [cell for cell in header if cell and cell not in used | other_ways]
    return columns, [_unused(cell, mapping) for cell in left if not used & {beside(cell, HELD), beside(cell, LINEAR)}]


def beside(cell: str, way: str) -> str:
    """The header cell of what goes another way between its samples than the column of that cell."""
    return f"{cell}, {way}"


def _split(cell: str) -> tuple[str, str | None]:
    parts = _CELL.fullmatch(cell.strip())
    return (parts["name"], parts["unit"]) if parts else (cell.strip(), None)


def _require(path: Path, header: Sequence[str], places: Mapping[str, str], mapping: Mapping[str, ColumnMap]) -> None:
    driven = next((name for name in DRIVING if name in places), "command")
    reasons = {"t": "rows need their time", driven: "the command is the model's input, or the reference of a loop"}
    for name, reason in reasons.items():
        if name not in places and mapping.get(name, ColumnMap()).period is None:
            title = cell_name(mapping.get(name, ColumnMap()).column or SIGNALS[name].label)
            clock = "" if name == "command" else ", as a column or by its period"
            hint = f'add "{title}" or map it in [signals]{clock}; columns here: {_listed(header) or "none"}'
            raise InputError(f'{path}: no column "{title}": {reason}; {hint}')


def _column(path: Path, name: str, cell: str, mapped: ColumnMap) -> Column:
    unit = mapped.unit if mapped.unit is not None else _split(cell)[1]
    if unit is None and name == "t":
        unit = "s"  # arrays of a MAT file have no unit, and time is in seconds everywhere
    where = f'{path}: column "{cell}"'
    if unit is None and mapped.scale is None and mapped.to is None:
        raise InputError(f'{where}: no unit; write "{SIGNALS[name].label}" or give its unit in [signals]')
    misfit = unit is not None and not _fits(where, unit, SIGNALS[name].si)
    if misfit and mapped.scale is None and mapped.to is None:
        hint = f'write one like "{SIGNALS[name].unit}", or give scale in [signals]'
        raise InputError(f'{where}: unit "{unit}" is not one of {name}; {hint}')
    if mapped.to is not None and not _fits(where, mapped.to, SIGNALS[name].si):
        raise InputError(f'{where}: to = "{mapped.to}" is no unit of {name}; write one like "{SIGNALS[name].unit}"')
    scale = 1.0 if mapped.scale is None else mapped.scale
    return Column(cell, None if misfit else unit, scale, mapped.clip, mapped.to, mapped.offset, mapped.between)


def _fits(where: str, unit: str, si: str) -> bool:
    try:
        to_si(0.0, unit, unit)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return converts(unit, si)


def _unused(cell: str, mapping: Mapping[str, ColumnMap]) -> str:
    name = _split(cell)[0]
    return f'"{cell}"' + (f' (mapped to "{mapping[name].column}")' if name in mapping else "")


def _listed(cells: Sequence[str]) -> str:
    more = len(cells) - _MOST_NAMED
    return ", ".join(f'"{cell}"' for cell in cells[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
