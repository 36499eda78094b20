"""A table of a report: sortable, numbers short, the best of a column marked."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Literal

Cell = str | float | int | bool | None
_MANY = 11  # columns: a table with more of them is set narrower
_LONG = 32  # letters: a column with longer texts has cells of several lines


@dataclass(frozen=True, repr=False)
class Table:
    """Rows of cells under column headers. best: the columns whose least or greatest number is marked.

    None is shown as an en dash, a float with four significant digits, bool as yes or no. Raises ValueError when a row
    does not fit the columns or `best` names a column that is not there.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    note: str = ""
    best: Mapping[str, Literal["min", "max"]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for index, row in enumerate(self.rows, 1):
            if len(row) != len(self.columns):
                raise ValueError(f'table "{self.title}" row {index}: {len(row)} cells for {len(self.columns)} columns')
        if missing := set(self.best) - set(self.columns):
            raise ValueError(f'table "{self.title}": best names no column: {", ".join(sorted(missing))}')

    def __repr__(self) -> str:
        return table_text(self)

    def _repr_html_(self) -> str:
        from .show import small_table_html

        return small_table_html(self)


def shown(cell: Cell) -> str:
    """The text of a cell: at most about four significant digits, no exponent between 1e-4 and 1e7."""
    if cell is None or cell != cell:
        return "–"
    if isinstance(cell, str):
        return cell
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, int):
        return str(cell)
    return _number(float(cell))


def table_text(table: Table) -> str:
    """The table in aligned columns for a terminal, numbers to the right."""
    lines = [list(table.columns), *([shown(cell) for cell in row] for row in table.rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(table.columns))]
    right = [_numeric([row[i] for row in table.rows]) for i in range(len(table.columns))]

    def aligned(line: Sequence[str]) -> str:
        cells = zip(line, widths, right, strict=True)
        return "  ".join(cell.rjust(width) if to_right else cell.ljust(width) for cell, width, to_right in cells)

    return "\n".join([*([table.title] if table.title else []), *(aligned(line).rstrip() for line in lines)])


def table_html(table: Table) -> str:
    """The table in a box of its own that scrolls sideways, so that the page never does."""
    best = {table.columns.index(name): _best(table, name) for name in table.best}
    numeric = [_numeric([row[i] for row in table.rows]) for i in range(len(table.columns))]
    head = "".join(
        f'<th scope="col"{_class("num" if numeric[i] else "")}><button type="button">{_breakable(name)}</button></th>'
        for i, name in enumerate(table.columns)
    )
    wraps = [any(len(shown(row[i])) > _LONG for row in table.rows) for i in range(len(numeric))]
    body = "\n".join(
        "<tr>" + "".join(_cell(cell, numeric[i], best.get(i), wraps[i]) for i, cell in enumerate(row)) + "</tr>"
        for row in table.rows
    )
    dense = _class("dense" if len(numeric) > _MANY else "")
    note = " ".join(filter(None, (table.note, "The best of a column is marked." if table.best else "")))
    return (
        f'<div class="item table">\n<h3>{escape(table.title)}</h3>\n'
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(table.title)}">\n'
        f"<table{dense}><thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>\n</div>\n"
        + (f'<p class="note">{escape(note)}</p>\n' if note else "")
        + "</div>\n"
    )


def _number(value: float) -> str:
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    if value == 0:
        return "0"
    power = math.floor(math.log10(abs(value)))
    if -4 <= power < 7:
        text = f"{value:.{max(3 - power, 0)}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    digits, exponent = f"{value:.3e}".split("e")
    return f"{digits.rstrip('0').rstrip('.')}e{int(exponent)}"


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool) and cell == cell


def _numeric(column: Sequence[Cell]) -> bool:
    there = [cell for cell in column if cell is not None]
    return bool(there) and all(isinstance(cell, (int, float)) and not isinstance(cell, bool) for cell in there)


def _best(table: Table, name: str) -> Cell:
    index = table.columns.index(name)
    values = [row[index] for row in table.rows if _is_number(row[index])]
    pick = min if table.best[name] == "min" else max
    return pick(values, default=None, key=lambda cell: float(cell or 0))


def _cell(cell: Cell, numeric: bool, best: Cell, wraps: bool) -> str:
    marked = best is not None and _is_number(cell) and cell == best
    value = f' data-v="{float(cell)!r}"' if _is_number(cell) and isinstance(cell, (int, float)) else ""
    name = " ".join(filter(None, ("num" if numeric else "", "best" if marked else "", "long" if wraps else "")))
    return f"<td{_class(name)}{value}>{escape(shown(cell))}</td>"


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""


def _breakable(name: str) -> str:
    """A header that may break after an underscore: settling_s is wider than its numbers."""
    return escape(name).replace("_", "_<wbr>")
