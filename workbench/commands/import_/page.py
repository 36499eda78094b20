"""What an import says: every column with its picture and guess, what does not fit the rig, what is to be done."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.words import counted
from ...identify.columns.guess import ColumnGuess
from ...identify.columns.roles import Roles
from ...records.foreign import ConvertedTable
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...report.table import table_text
from ...rigs.rig import Rig
from .written import line_to_add, signal_entries

_TELLING, _PANELS = ("command", "position", "pa", "load_pressure", "force"), 3
_BARS = "▁▂▃▄▅▆▇█"
_WIDTH, _DRAWN, _HEIGHT = 24, 60, 170  # letters of a picture, pictures on a page, pixels each


def metrics(
    guesses: Sequence[ColumnGuess], roles: Roles, parts: Sequence[ConvertedTable], problem: str, mends: Sequence[str]
) -> dict[str, Any]:
    """metrics.json; the contract's `signals`, and all that the page says."""
    return {
        "signals": signal_entries(guesses),
        "columns": [_row(guess) for guess in guesses],
        "left_out": {guess.column.cell: line_to_add(guess) for guess in guesses if guess.signal is None},
        "misfits": misfits(guesses),
        "records": {role: list(entries) for role, entries in roles.entries.items()},
        "files": [{"file": p.file, "from": p.origin, "rows": p.rows, "notes": list(p.notes)} for p in parts],
        "mended": list(mends),
        "ready": not problem,
        "problem": problem,
    }


def column_lines(numbers: Mapping[str, Any]) -> str:
    """One line a column, for a terminal, then how the files were read."""
    rows = [
        [c["column"], c["unit"] or "", c["low"], c["high"], f"{100 * c['missing']:.2g} %", c["picture"],
         c["signal"] or "left out", c["confidence"] or ""]
        for c in numbers["columns"]
    ]  # fmt: skip
    heads = ["column", "unit", "low", "high", "missing", "picture", "signal", "how sure"]
    files: dict[str, list[str]] = {}
    for file in numbers["files"]:
        for note in file["notes"]:
            files.setdefault(note, []).append(file["file"])
    notes = [f"{names[0] if len(names) == 1 else counted(len(names), 'file')}: {note}" for note, names in files.items()]
    return "\n".join([table_text(Table("", heads, rows)), *notes])


def _row(guess: ColumnGuess) -> dict[str, Any]:
    column = guess.column
    return {
        "column": column.cell, "unit": column.unit, "low": column.low, "high": column.high, "missing": column.missing,
        "between": column.between, "picture": bars(column.sketch), "signal": guess.signal,
        "confidence": guess.confidence or None, "reason": guess.reason,
    }  # fmt: skip


def misfits(guesses: Sequence[ColumnGuess]) -> list[str]:
    """What does not fit the rig, a sentence a column."""
    return [
        f'{guess.signal} of column "{guess.column.cell}" {guess.conversion.problem}'
        for guess in guesses
        if guess.conversion is not None and guess.conversion.problem and guess.signal is not None
    ]


def column_table(guesses: Sequence[ColumnGuess]) -> Table:
    """One line a column."""
    rows = [
        [g.column.cell, g.column.unit, g.column.low, g.column.high, f"{100 * g.column.missing:.2g} %",
         g.column.between or "every row", bars(g.column.sketch), g.signal or "left out", g.confidence or None, g.reason]
        for g in guesses
    ]  # fmt: skip
    heads = ["column", "unit", "low", "high", "missing", "between samples", "picture", "signal", "how sure", "why"]
    change = 'To change how a channel goes between its samples, write between = "held" or "linear" in its line of '
    change += "campaign.toml."
    slow = any(guess.column.between for guess in guesses)
    return Table("What each column is taken for", heads, rows, change if slow else "")


def bars(values: np.ndarray) -> str:
    """A picture of values [n] in a line of text; a blank where all are missing."""
    known = values[np.isfinite(values)]
    if not known.size:
        return ""
    scale = np.abs(known).max() or 1.0  # whose differences and sums are finite
    known, values = known / scale, values / scale
    low, span = known.min(), np.ptp(known) or 1.0
    pieces = np.array_split(values, min(_WIDTH, values.size))
    means = [float(np.mean(p[np.isfinite(p)])) if np.isfinite(p).any() else None for p in pieces]
    return "".join(" " if m is None else _BARS[min(7, int(8 * (m - low) / span))] for m in means)


def import_page(
    guesses: Sequence[ColumnGuess],
    roles: Roles,
    parts: Sequence[ConvertedTable],
    rig: Rig,
    problem: str,
    mends: Sequence[str],
) -> tuple[Page, Figure]:
    """The report and its telling figure."""
    figures = [_figure(guess) for guess in guesses[:_DRAWN]]
    left = [g for g in guesses if g.signal is None]
    lines = Table("Left out: lines to add under [signals]", ["line", "why"], [[line_to_add(g), g.reason] for g in left])
    division = [[role, _entry(entry)] for role, entries in roles.entries.items() for entry in entries]
    used = [Table("Records", ["role", "record"], division, roles.reason)] if division else [roles.reason]
    files = [[part.file, part.origin, part.rows, "; ".join(part.notes)] for part in parts]
    sections = [
        Section("Columns", [column_table(guesses), *([lines] if left else [])]),
        *([Section("What does not fit the rig", [*misfits(guesses), *([problem] if problem else [])])]
          if misfits(guesses) or problem else []),
        Section("What judges", used),
        Section("How the files were read", [Table("Files", ["record", "from", "rows", "how"], files), *mends]),
        Section("Pictures", figures),
    ]  # fmt: skip
    return Page(f"Recordings of {rig.name}, imported", _verdict(guesses, problem, mends), sections), _telling(guesses)


def _entry(entry: Any) -> str:
    if isinstance(entry, str):
        return entry
    ends = " ".join(f"{key} {entry[key]:g} s" for key in ("from", "to") if key in entry)
    return f"{entry['file']}, {ends}"


def _verdict(guesses: Sequence[ColumnGuess], problem: str, mends: Sequence[str]) -> str:
    told = [guess.signal for guess in guesses if guess.signal is not None]
    counts = f"{len(told)} of {len(guesses)} columns are taken for signals: {', '.join(told) or 'none'}."
    if problem:
        return f"{counts} The folder is no campaign yet: {problem}."
    misfit = misfits(guesses)
    doubts = f" {len(misfit)} {'does' if len(misfit) == 1 else 'do'} not fit the rig: {misfit[0]}." if misfit else ""
    more = f", and {len(mends) - 1} more on the page" if len(mends) > 1 else ""
    mended = f" Mended on reading: {mends[0]}{more}." if mends else ""
    return f"{counts}{doubts}{mended} jackbench residual takes the folder."


def _telling(guesses: Sequence[ColumnGuess]) -> Figure:
    """Command, position and pressure, as far as there are such; else the first columns."""
    by_signal = {guess.signal: guess for guess in guesses}
    telling = [by_signal[name] for name in _TELLING if name in by_signal] or list(guesses)
    panels = [panel for guess in telling[:_PANELS] for panel in _figure(guess).panels]
    return Figure("As recorded", "row", panels)


def _figure(guess: ColumnGuess) -> Figure:
    column = guess.column
    label = f"{column.cell}" if guess.column.unit is None or "[" in column.cell else f"{column.cell} [{column.unit}]"
    title = f"{column.cell}: {guess.signal or 'left out'}"
    return Figure(title, "row", [Panel(label, [Curve("recorded", _rows(guess), column.sketch)])], height=_HEIGHT)


def _rows(guess: ColumnGuess) -> np.ndarray:
    """The rows that a sketch stands for."""
    return np.linspace(1, max(guess.column.sketched, 1), guess.column.sketch.size)
