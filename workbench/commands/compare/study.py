"""Finished runs side by side: how their metrics differ, and their steps, Bode plots and sensitivities overlaid."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...base.words import agreed, counted
from ...loop.metrics import CHANGES, metric
from ...loop.scenarios import SCENARIOS
from ...report import Figure, Known, Page, Section, Table
from ...report.table import Cell
from ..common.outcome import REPORT, Outcome
from .finished import Finished
from .overlays import bars, bodes, residuals, sensitivities, steps

Identity = tuple[tuple[str, str], ...]

_NOT_AN_ID = ("tripped",)  # texts that are results
_RESULTS = ("metric", "values", "difference", "percent")
_TIMING = ("timing", "speed")
_UNITS = {"_s": "s", "_percent": "%", "_hz": "Hz", "_db": "dB", "_deg": "deg", "_ms": "ms", "_us": "us"}
_OF_ITS_ROW = ("value", "rms", "floor")  # metrics whose unit the row says
_NO_RATIO = ("%", "dB", "deg")  # units in which a ratio says nothing
TELLING = ("settling_s", "overshoot_percent", "ms", "rms", "f90_hz", "f3db_hz", "f90", "f3db", "value", "chi2", "iae")


def run_compare(runs: Sequence[Finished]) -> Outcome:
    """Compare runs; differences are against the first. Raises InputError when they share neither rows nor curves."""
    rows = differences(runs)
    sections = [
        Section("Steps", list(steps(runs))),
        Section("Bode", list(bodes(runs))),
        Section("Sensitivity", list(sensitivities(runs))),
        Section("Residuals", list(residuals(runs))),
    ]
    sections = [section for section in sections if section.items]
    if not rows and not sections:
        raise InputError(f"{runs[0].name} and {runs[1].name} share neither rows nor curves; compare runs of one kind")
    tables = Section("Differences", [_table(runs, rows), _settings(runs)])
    figures = [item for section in sections for item in section.items if isinstance(item, Figure)]
    telling = figures[0] if figures else bars(runs, rows)
    title = "Comparison of " + ", ".join(run.name for run in runs)
    page = Page(title, _verdict(runs, rows), [tables, *sections], head={"runs": _runs_words(runs)})
    return Outcome({"rows": rows}, lambda: (page, telling))


def _runs_words(runs: Sequence[Finished]) -> str:
    """Each with its rig and when it finished, where its config says so."""
    told = [[run.config.get("rig.name"), run.config.get(f"{REPORT}.date")] for run in runs]
    words = [", ".join(str(text) for text in texts if text) for texts in told]
    return "; ".join(f"{run.name} ({text})" if text else run.name for run, text in zip(runs, words, strict=True))


def differences(runs: Sequence[Finished]) -> list[dict[str, Any]]:
    """One row for each metric of each row that two or more runs share: values by run; differences from the first.

    The first is the first of those that share the row. Rows are the same that agree in their texts. A text that is one
    and the same within every run but differs between runs (a rig, a controller) tells runs apart, not rows.
    """
    keys = _id_keys([run.rows for run in runs])
    if not keys and any(len(run.rows) > 1 for run in runs):
        return []
    indexed = {run.name: _indexed(run, keys) for run in runs}
    order = dict.fromkeys(identity for rows in indexed.values() for identity in rows)
    compared = []
    for identity in order:
        sharing = {name: rows[identity] for name, rows in indexed.items() if identity in rows}
        if len(sharing) > 1:
            counts = Counter(key for row in sharing.values() for key in row if key not in keys)
            shared = [key for key, count in counts.items() if count > 1]
            compared += [row for key in shared if (row := _difference(identity, key, sharing)) is not None]
    return compared


def _id_keys(runs: Sequence[Sequence[Mapping[str, Any]]]) -> list[str]:
    """The keys that tell rows apart: those whose values are all texts, unless they only tell runs apart."""
    rows = [row for run in runs for row in run]
    texts = [key for key in dict.fromkeys(k for row in rows for k in row) if key not in _NOT_AN_ID]
    texts = [key for key in texts if all(isinstance(row.get(key), str) for row in rows)]

    def tells_rows(key: str) -> bool:
        within = [{row[key] for row in run} for run in runs if run]
        return any(len(values) > 1 for values in within) or all(values == within[0] for values in within)

    return [key for key in texts if tells_rows(key)]


def _indexed(run: Finished, keys: Sequence[str]) -> dict[Identity, dict[str, Any]]:
    """Rows by identity, numbered where they are alike; what a run says of all rows is a row of its own."""
    indexed: dict[Identity, dict[str, Any]] = {}
    for row in run.rows:
        identity = plain = tuple((key, row[key]) for key in keys)
        while identity in indexed:
            identity = (*plain, ("row", str(len(indexed) + 1)))
        indexed[identity] = row
    of_all = {key: v for key, v in run.metrics.items() if key not in _TIMING and not isinstance(v, dict | list)}
    return indexed | ({(("rows", "all"),): of_all} if of_all else {})


def _difference(identity: Identity, key: str, sharing: Mapping[str, Mapping[str, Any]]) -> dict[str, Any] | None:
    """One metric of one row; None where no run has it, and for a text or a yes-or-no on which all agree."""
    values = {name: row.get(key) for name, row in sharing.items()}
    there = [value for value in values.values() if value is not None]
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in there)
    if not there or (not numeric and len(set(map(str, values.values()))) == 1):
        return None
    first, *others = values
    base = values[first]
    row = {**dict(identity), "metric": key}
    difference: dict[str, float | None] = dict.fromkeys(others)
    percent: dict[str, float | None] = dict.fromkeys(others)
    for name in others if numeric and base is not None else ():
        if (value := values[name]) is not None:
            difference[name] = value - base
            if base and compared(row).unit not in _NO_RATIO:
                percent[name] = 100 * (value - base) / abs(base)
    return {**row, "values": values, "difference": difference, "percent": percent}


@dataclass(frozen=True)
class ComparedMetric:
    """How a metric is shown: `name`, `unit`, the `factor` from metrics.json to it, the `least` change that counts, 0
    where every change does, and which way is `better`: "less", "more", or "" where neither is."""

    name: str
    unit: str
    factor: float
    least: float
    better: str

    def cell(self, value: object) -> Cell:
        """A value as a cell of a table."""
        if isinstance(value, bool | str) or value is None:
            return value
        assert isinstance(value, int | float)
        return Known(value * self.factor, self.least)

    def text(self, value: object) -> str:
        """A value with its unit."""
        shown = "never" if value is None else f"{self.cell(value)}"
        return f"{shown} {self.unit}" if self.unit != "1" and value is not None else shown

    def is_change(self, difference: float) -> bool:
        """Whether a difference is one that counts."""
        return abs(difference * self.factor) > self.least

    def judged(self, difference: float) -> str:
        """Whether a difference is "better" or "worse"; nothing where it does not count, or neither is."""
        if not self.better or not self.is_change(difference):
            return ""
        return "better" if (difference < 0) == (self.better == "less") else "worse"


def compared(row: Mapping[str, Any]) -> ComparedMetric:
    """The metric of a row of differences, by its name, its unit and the signal of its scenario."""
    key, scenario = str(row["metric"]), str(row.get("scenario", ""))
    of, known = metric(key), SCENARIOS.get(scenario)
    if of is None:
        unit = next((unit for end, unit in _UNITS.items() if key.endswith(end)), "1")
        return ComparedMetric(key, unit, 1.0, CHANGES.get(unit, 0.0), "")
    signal = SIGNALS[known.signal if known else "force" if scenario.startswith("force") else "position"]
    unit, factor = of.read_in(signal)
    if key in _OF_ITS_ROW and isinstance(row.get("unit"), str):
        unit = row["unit"]
    return ComparedMetric(of.name, unit or "1", factor, CHANGES.get(unit, 0.0), of.better)


def _table(runs: Sequence[Finished], rows: Sequence[Mapping[str, Any]]) -> Table:
    keys = list(dict.fromkeys(key for row in rows for key in row if key not in _RESULTS and key != "unit"))
    others = [run.name for run in runs[1:]]
    heads = [*keys, "metric", "unit", *(run.name for run in runs)]
    heads += [text.format(name) for text in ("{}: change", "{}: change [%]", "{} is") for name in others]
    return Table(
        "Metrics of the rows that runs share",
        heads,
        [_line(row, keys, runs) for row in rows],
        note="Changes are from the first run that has the row. They have no percentage where a change is below what a "
        "sensor resolves, or where a ratio says nothing.",
        fold=True,
    )


def _line(row: Mapping[str, Any], keys: Sequence[str], runs: Sequence[Finished]) -> list[Cell]:
    shown, others = compared(row), [run.name for run in runs[1:]]
    changes = {name: row["difference"].get(name) for name in others}
    percent = {
        name: row["percent"].get(name) if value is not None and shown.is_change(value) else None
        for name, value in changes.items()
    }
    return [
        *(row.get(key) for key in keys),
        shown.name,
        shown.unit,
        *(shown.cell(row["values"].get(run.name)) for run in runs),
        *(shown.cell(changes[name]) for name in others),
        *(None if value is None else Known(value, 0.1) for value in percent.values()),
        *("" if value is None else shown.judged(value) for value in changes.values()),
    ]


def _settings(runs: Sequence[Finished]) -> Table:
    """What the runs' configurations do not share."""
    keys = dict.fromkeys(key for run in runs for key in run.config)
    lines = [
        [key, *("" if run.config.get(key) is None else str(run.config[key]) for run in runs)]
        for key in keys
        if not key.startswith(f"{REPORT}.")
        and not key.endswith((".source", ".bounds"))
        and len({str(run.config.get(key)) for run in runs}) > 1
    ]
    return Table("Settings in which the runs differ", ["setting", *(run.name for run in runs)], lines)


def _verdict(runs: Sequence[Finished], rows: Sequence[Mapping[str, Any]]) -> str:
    """How many numbers changed by more than 1 % and a sensor's resolution, and the change that tells most."""
    first, changes = runs[0].name, [_Change(row, name) for row in rows for name in row["difference"]]
    numbers = [change for change in changes if change.difference is not None]
    lost = [change for change in changes if change.is_lost]
    if not numbers and not lost:
        return f"{', '.join(run.name for run in runs)}: no number to compare; the curves are below."
    moved, of = [change for change in numbers if change.counts], counted(len(numbers), "number")
    if not moved and not lost:
        return f"None of {of} changes by more than 1 % from {first} and by more than a sensor resolves."
    said = f"{len(moved)} of {of} {agreed('change', len(moved))} by more than 1 % from {first}"
    said += f", {len(lost)} are there in one run alone" if lost else ""
    order = {key: place for place, key in enumerate(TELLING)}
    last = len(order)
    most = min(lost or moved, key=lambda change: (order.get(change.row["metric"], last), -change.size))
    return f"{said}. Most telling: {most.words(first)}."


@dataclass(frozen=True)
class _Change:
    """A row of differences in one of the later runs."""

    row: Mapping[str, Any]
    run: str

    @property
    def difference(self) -> float | None:
        return self.row["difference"][self.run]

    @property
    def size(self) -> float:
        """In percent; a change from 0 is the largest."""
        percent = self.row["percent"][self.run]
        return float("inf") if percent is None else abs(percent)

    @property
    def counts(self) -> bool:
        """Whether it is beyond 1 % and what is resolved."""
        return self.difference is not None and self.size > 1 and compared(self.row).is_change(self.difference)

    @property
    def is_lost(self) -> bool:
        """Whether a loop settles in one run alone."""
        values = [self.row["values"][name] for name in (next(iter(self.row["values"])), self.run)]
        return self.row["metric"] == "settling_s" and (values[0] is None) != (values[1] is None)

    def words(self, first: str) -> str:
        """ "position-10mm, p-dp: settling 0.093 s in b instead of 0.122 s (-24 %)"."""
        shown, values, percent = compared(self.row), self.row["values"], self.row["percent"][self.run]
        keys = sorted((key for key in self.row if key not in (*_RESULTS, "unit")), key=lambda key: key != "scenario")
        where = ", ".join(str(self.row[key]) for key in keys)
        before = values[first if first in values else next(iter(values))]
        way = "" if self.difference is None else shown.judged(self.difference)
        told = ", ".join(filter(None, ("" if percent is None else f"{percent:+.3g} %", way)))
        share = f" ({told})" if told else ""
        name = f"{where}: {shown.name}" if where else shown.name
        return f"{name} {shown.text(values[self.run])} in {self.run} instead of {shown.text(before)}{share}"
