"""What differs between a valve's sheet when it was new and the campaign: number by number, and line by line.

The rig as the sheet has it is the base of the trace, its numbers within the sheet's intervals. A number is another one
now where the trace says that the records contradict it; a line where its two intervals do not meet.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...base.errors import InputError
from ...base.units import from_si
from ...base.words import counted, listed
from ...identify.acceptance.valve_test import valve_sheet
from ...identify.acceptance.when_new import NewRig
from ...identify.found.alike import explain_alike
from ...identify.found.fitted import interval_cells, unbounded
from ...identify.trace.findings import Trace
from ...records import Campaign
from ...report import Figure, Page, Section, Table
from ...report.table import Cell, shown
from .answer import TraceAnswer
from .metrics import numbers_of

_PLAYS = 4.0  # chi2 of a sheet's lines, above which the rig's model is not the sheet's valve
_KEYS = {part: (part, f"{part}_low", f"{part}_high") for part in ("new", "now")}
_NOTE = (
    "New: by the sheet. Now: by the records alone, 95 %. A number has changed where the trace finds it beyond the "
    "sheet's interval, by its usual rule."
)
_LINES = "Changed: the two intervals do not meet. Lines that the records do not tell are left out."


@dataclass(frozen=True)
class SinceNew:
    """What a sheet when new said, and what of it has changed: rows as metrics.json has them; whether a misfit is
    `left` that the trace does not explain."""

    numbers: Sequence[Mapping[str, Any]]
    lines: Sequence[Mapping[str, Any]]
    unread: str
    chi2: float
    left: bool


def beside_new(
    answer: TraceAnswer, campaign: Campaign, new: NewRig, rows: Mapping[str, Mapping[str, Any]]
) -> TraceAnswer:
    """The answer of a trace from `new` on, with what differs from the sheet of `rows` in its report and metrics."""
    lines, unread = _lines(campaign, new, rows)
    left = answer.trace.verdict in ("unknown", "incomplete")
    since = SinceNew(_numbers(answer.trace, new), lines, unread, new.chi2, left)
    own = answer.outcome

    def draw() -> tuple[Page, Figure | None]:
        page, figure = own.draw()
        verdict = f"{sentence(since)} {page.verdict}"
        whole = replace(page, verdict=verdict, sections=[_section(since), *page.sections])
        return whole, figure

    table = {"numbers": since.numbers, "lines": since.lines, "lines_unread": unread or None, "chi2_of_sheet": new.chi2}
    metrics = {**own.metrics, "since_new": table}
    return replace(answer, outcome=replace(own, metrics=metrics, draw=draw))


def _numbers(trace: Trace, new: NewRig) -> list[dict[str, Any]]:
    """The valve's numbers: new, and now where the records say so; `alike` are what would explain it as well."""
    found = {wrong.number.name: (wrong.value, wrong.low, wrong.high) for wrong in numbers_of(trace)}
    seen = unbounded(trace.problem.rig, trace.final.fit)
    rows = []
    for name in new.names:
        number = new.rig.numbers[name]
        now = found.get(name) or seen.get(name)
        cells = [number.value, number.low, number.high, *(now or (None, None, None))]
        values = [None if cell is None else float(from_si(cell, number.unit, number.si)) for cell in cells]
        row = {"number": name, "unit": number.unit, **dict(zip((*_KEYS["new"], *_KEYS["now"]), values, strict=True))}
        alike = [other.removeprefix("number.") for other in explain_alike(trace, name)] if name in found else []
        rows.append({**row, "changed": name in found, "alike": alike})
    others = {other for row in rows for other in row["alike"]}
    return [{**row, "perhaps": not row["changed"] and row["number"] in others} for row in rows]


def _lines(campaign: Campaign, new: NewRig, rows: Mapping[str, Mapping[str, Any]]) -> tuple[list[dict[str, Any]], str]:
    """Lines of the sheet that the records tell too, and why they tell none."""
    try:
        now = valve_sheet((*campaign.train, *campaign.select, *campaign.heldout), new.rig).rows
    except InputError as error:
        return [], str(error)
    found = []
    for row in now:
        old = rows.get(row.id)
        if row.value is None or row.low is None or row.high is None or old is None:
            continue
        changed = row.low > old["high"] or row.high < old["low"]
        then = {"new": old["value"], "new_low": old["low"], "new_high": old["high"]}
        own = {"now": row.value, "now_low": row.low, "now_high": row.high}
        found.append({"line": row.id, "unit": row.unit, **then, **own, "changed": changed})
    return found, "" if found else "the records tell no line that the sheet has"


def sentence(since: SinceNew) -> str:
    """What has changed, in words."""
    changed = [row for row in since.numbers if row["changed"]]
    same = len(since.numbers) - len(changed) - sum(row["perhaps"] for row in since.numbers)
    told = [_told(row) for row in changed]
    kept = [f"{counted(same, 'number')} of the valve {_is(same)} as when new"] if same and not since.left else []
    kept += ["something differs that no number of the valve explains"] if since.left else []
    return f"Against the sheet when new: {'; '.join([*told, *kept])}.{_moved(since.lines)}"


def _moved(lines: Sequence[Mapping[str, Any]]) -> str:
    if not lines:
        return ""
    changed = [row["line"] for row in lines if row["changed"]]
    of = f" Of the sheet's lines the records tell {len(lines)}; "
    return of + (
        f"{listed(changed)} {'has' if len(changed) == 1 else 'have'} changed." if changed else "none has changed."
    )


def _told(row: Mapping[str, Any]) -> str:
    new, now = ([shown(cell) for cell in _to_digits(row, part)] for part in ("new", "now"))
    told = f"{row['number']} was {new[0]} ({new[1]} to {new[2]}) and is {now[0]} ({now[1]} to {now[2]}) {row['unit']}"
    return f"{told}, or {listed(row['alike'], 'or')} instead" if row["alike"] else told


def _is(count: int) -> str:
    return "is" if count == 1 else "are"


def _section(since: SinceNew) -> Section:
    head = ["", "new", "low", "high", "now", "low", "high", "unit", "changed"]
    tables = [Table("Numbers of the valve", head, [_cells(row, "number") for row in since.numbers], _NOTE)]
    if since.lines:
        tables.append(Table("Lines of the sheet", head, [_cells(row, "line") for row in since.lines], _LINES))
    said = [f"No line is compared: {since.unread}."] if since.unread else []
    if since.chi2 > _PLAYS:
        said.append(
            f"The rig's model does not play the sheet within its intervals (chi2 {since.chi2:.3g}): intervals of the "
            "numbers when new are wider by as much."
        )
    return Section("Since the valve was new", [*tables, *said])


def _cells(row: Mapping[str, Any], name: str) -> list[Any]:
    told = "yes" if row["changed"] else "perhaps" if row.get("perhaps") else "no"
    return [row[name], *_to_digits(row, "new"), *_to_digits(row, "now"), row["unit"], told]


def _to_digits(row: Mapping[str, Any], part: str) -> list[Cell]:
    return interval_cells([row[key] for key in _KEYS[part]])
