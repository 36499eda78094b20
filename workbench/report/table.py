"""A table of a report: sortable, numbers short, the best of a column marked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from typing import Literal

from .digits import Known, four_digits

Cell = str | float | int | bool | Known | None
_MANY = 11  # columns: a table with more of them is set narrower
_LONG = 32  # letters: a column with longer texts has cells of several lines
_ALIKE = 3  # rows: with fewer, a column that says the same in all of them is no repetition


@dataclass(frozen=True, repr=False)
class Table:
    """Rows of cells under column headers. best: the columns whose least or greatest number is marked.

    Where some rows have a number in the first of these, the others win nothing. within: the column whose equal cells
    make a group, in which alone rows compete. fold: a column that says the same in every row, of three or more, is told
    in the note instead. None is shown as an en dash, a float with four significant digits, bool as yes or no. Raises
    ValueError when a row does not fit the columns, or `best` or `within` names a column that is not there.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    note: str = ""
    best: Mapping[str, Literal["min", "max"]] = field(default_factory=dict)
    within: str = ""
    fold: bool = False

    def __post_init__(self) -> None:
        for index, row in enumerate(self.rows, 1):
            if len(row) != len(self.columns):
                raise ValueError(f'table "{self.title}" row {index}: {len(row)} cells for {len(self.columns)} columns')
        if missing := {*self.best, *filter(None, [self.within])} - set(self.columns):
            raise ValueError(f'table "{self.title}": best names no column: {", ".join(sorted(missing))}')

    def __repr__(self) -> str:
        return table_text(self)

    def _repr_html_(self) -> str:
        from .show import small_table_html

        return small_table_html(self)


def shown(cell: Cell) -> str:
    """The text of a cell: a number to what is known of it, or to about four significant digits."""
    if cell is None or cell != cell:
        return "–"
    if isinstance(cell, str):
        return cell
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, int | Known):
        return str(cell)
    return four_digits(float(cell))


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
    table = folded(table) if table.fold else table
    marked = best_cells(table)
    numeric = [_numeric([row[i] for row in table.rows]) for i in range(len(table.columns))]
    head = "".join(
        f'<th scope="col"{_class("num" if numeric[i] else "")}><button type="button">{_breakable(name)}</button></th>'
        for i, name in enumerate(table.columns)
    )
    wraps = [any(len(shown(row[i])) > _LONG for row in table.rows) for i in range(len(numeric))]
    body = "\n".join(
        "<tr>" + "".join(_cell(cell, numeric[i], (n, i) in marked, wraps[i]) for i, cell in enumerate(row)) + "</tr>"
        for n, row in enumerate(table.rows)
    )
    dense = _class("dense" if len(numeric) > _MANY else "")
    note = " ".join(filter(None, (table.note, _best_words(table) if marked else "")))
    return (
        f'<div class="item table">\n<h3>{escape(table.title)}</h3>\n'
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(table.title)}">\n'
        f"<table{dense}><thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>\n</div>\n"
        + (f'<p class="note">{escape(note)}</p>\n' if note else "")
        + "</div>\n"
    )


def folded(table: Table) -> Table:
    """The table without the columns that say the same in every row; its note says what."""
    if len(table.rows) < _ALIKE:
        return table
    texts = [{shown(row[i]) for row in table.rows} for i in range(len(table.columns))]
    alike = [i for i in range(1, len(texts)) if len(texts[i]) == 1 and table.columns[i] != table.within]
    told = ", ".join(f"{table.columns[i]}: {shown(table.rows[0][i])}" for i in alike)
    note = " ".join(filter(None, (table.note, f"In every row: {told}." if told else "")))
    keep = [i for i in range(len(texts)) if i not in alike]
    best = {name: way for name, way in table.best.items() if table.columns.index(name) in keep}
    rows = [[row[i] for i in keep] for row in table.rows]
    return replace(table, columns=[table.columns[i] for i in keep], rows=rows, note=note, best=best)


def best_cells(table: Table) -> set[tuple[int, int]]:
    """(row, column) of the best numbers, each within its group; none where all of a group look the same."""
    key = table.columns.index(table.within) if table.within else None
    groups: dict[str, list[int]] = {}
    for number, row in enumerate(table.rows):
        groups.setdefault("" if key is None else shown(row[key]), []).append(number)
    return {
        (number, table.columns.index(name))
        for name, way in table.best.items()
        for group in groups.values()
        for number in _best(table, _competing(table, group), table.columns.index(name), way)
    }


def _competing(table: Table, group: Sequence[int]) -> Sequence[int]:
    """Rows of a group that have the first of the marked columns, where any has: what never settles wins nothing."""
    column = table.columns.index(next(iter(table.best)))
    return [number for number in group if _is_number(table.rows[number][column])] or group


def _best(table: Table, group: Sequence[int], column: int, way: str) -> list[int]:
    """Rows of a group that have its best number, as far as it is shown."""
    numbers = [number for number in group if _is_number(table.rows[number][column])]
    texts = {number: shown(table.rows[number][column]) for number in numbers}
    if len(set(texts.values())) < 2:
        return []
    first = (min if way == "min" else max)(numbers, key=lambda number: _float(table.rows[number][column]))
    return [number for number in numbers if texts[number] == texts[first]]


def _best_words(table: Table) -> str:
    return f"The best of a column is marked{f', for each {table.within}' if table.within else ''}."


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, int | float | Known) and not isinstance(cell, bool) and _float(cell) == _float(cell)


def _float(cell: Cell) -> float:
    return float(cell) if isinstance(cell, int | float | Known) else float("nan")


def _numeric(column: Sequence[Cell]) -> bool:
    there = [cell for cell in column if cell is not None]
    return bool(there) and all(isinstance(cell, int | float | Known) and not isinstance(cell, bool) for cell in there)


def _cell(cell: Cell, numeric: bool, marked: bool, wraps: bool) -> str:
    value = f' data-v="{_float(cell)!r}"' if _is_number(cell) else ""
    name = " ".join(filter(None, ("num" if numeric else "", "best" if marked else "", "long" if wraps else "")))
    return f"<td{_class(name)}{value}>{escape(shown(cell))}</td>"


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""


def _breakable(name: str) -> str:
    """A header that may break after an underscore, settling_s being wider than its numbers, but not inside a unit."""
    text, bracket, unit = escape(name).replace("_", "_<wbr>").partition("[")
    return text + bracket + unit.replace(" ", "&nbsp;")
