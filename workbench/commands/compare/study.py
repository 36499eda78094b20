"""Finished runs side by side: how their metrics differ, and their steps, Bode plots and sensitivities overlaid."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.gain_phase import gain_db
from ...base.signals import SIGNALS
from ...base.units import from_si
from ...loop.scenarios import SCENARIOS
from ...report import Curve, Figure, FrequencyCurve, Page, Panel, Section, Table, bode
from ..common.outcome import REPORT, Outcome
from .finished import Finished

Identity = tuple[tuple[str, str], ...]

_NOT_AN_ID = ("tripped",)  # texts that are results
_RESULTS = ("metric", "values", "difference", "percent")
_NO_RATIO = ("_percent", "_db", "_deg")  # metrics whose ratio says nothing
_TIMING = ("timing", "speed")
_SHOWN_HZ = 100.0  # linear curves run to the Nyquist frequency, where nothing is read off


def run_compare(runs: Sequence[Finished]) -> Outcome:
    """Compare runs; differences are against the first. Raises InputError when they share neither rows nor curves."""
    rows = differences(runs)
    sections = [
        Section("Steps", list(_steps(runs))),
        Section("Bode", list(_bodes(runs))),
        Section("Sensitivity", list(_sensitivity(runs))),
        Section("Residuals", list(_residuals(runs))),
    ]
    sections = [section for section in sections if section.items]
    if not rows and not sections:
        raise InputError(f"{runs[0].name} and {runs[1].name} share neither rows nor curves; compare runs of one kind")
    tables = Section("Differences", [_table(runs, rows), _settings(runs)])
    figures = [item for section in sections for item in section.items if isinstance(item, Figure)]
    telling = figures[0] if figures else _bars(runs, rows)
    title = "Comparison of " + ", ".join(run.name for run in runs)
    return Outcome({"rows": rows}, Page(title, _verdict(runs, rows), [tables, *sections]), telling)


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


def _difference(identity: Identity, metric: str, sharing: Mapping[str, Mapping[str, Any]]) -> dict[str, Any] | None:
    """One metric of one row; None where no run has it, and for a text or a yes-or-no on which all agree."""
    values = {name: row.get(metric) for name, row in sharing.items()}
    there = [value for value in values.values() if value is not None]
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in there)
    if not there or (not numeric and len(set(map(str, values.values()))) == 1):
        return None
    first, *others = values
    base = values[first]
    difference: dict[str, float | None] = dict.fromkeys(others)
    percent: dict[str, float | None] = dict.fromkeys(others)
    for name in others if numeric and base is not None else ():
        if (value := values[name]) is not None:
            difference[name] = value - base
            if base and not metric.endswith(_NO_RATIO):
                percent[name] = 100 * (value - base) / abs(base)
    return {**dict(identity), "metric": metric, "values": values, "difference": difference, "percent": percent}


def _table(runs: Sequence[Finished], rows: Sequence[Mapping[str, Any]]) -> Table:
    keys = list(dict.fromkeys(key for row in rows for key in row if key not in _RESULTS))
    others = [run.name for run in runs[1:]]
    heads = [
        *keys,
        "metric",
        *(r.name for r in runs),
        *(f"{name}, difference" for name in others),
        *(f"{name}, difference [%]" for name in others),
    ]
    lines = [
        [
            *(row.get(key) for key in keys),
            row["metric"],
            *(row["values"].get(run.name) for run in runs),
            *(row["difference"].get(name) for name in others),
            *(row["percent"].get(name) for name in others),
        ]
        for row in rows
    ]
    return Table("Metrics of the rows that runs share", heads, lines, note="Against the first that has the row.")


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
    changes = [(abs(p), name, row) for row in rows for name, p in row["percent"].items() if p is not None]
    moved = sum(change[0] > 1 for change in changes)
    if not changes:
        return f"{', '.join(run.name for run in runs)}: no number to compare; the curves are below."
    if not moved:
        return f"None of {len(changes)} numbers differs by more than 1 % from {runs[0].name}."
    _, name, row = max(changes, key=lambda change: change[0])
    where = " ".join(str(value) for key, value in row.items() if key not in _RESULTS)
    percent = row["percent"][name]
    return (
        f"{moved} of {len(changes)} numbers differ by more than 1 % from {runs[0].name}; the farthest is "
        f"{' '.join(filter(None, (where, row['metric'])))} of {name}, {percent:+.3g} %."
    )


def _curves(runs: Sequence[Finished], prefix: str) -> dict[str, list[tuple[str, dict[str, np.ndarray]]]]:
    """Tables PREFIX-CONTROLLER-REST as (label, columns), grouped by REST; groups of a single run are left out."""
    groups: dict[str, list[tuple[str, str, dict[str, np.ndarray]]]] = {}
    for run in runs:
        for table in (name for name in run.tables if name.startswith(f"{prefix}-")):
            rest = table.removeprefix(f"{prefix}-")
            owner = next((name for name in run.controllers if rest == name or rest.startswith(f"{name}-")), "")
            label = f"{run.name}: {owner}" if owner else run.name
            groups.setdefault(rest.removeprefix(owner).lstrip("-"), []).append((run.name, label, run.read(table)))
    return {
        rest: [(label, columns) for _, label, columns in group]
        for rest, group in groups.items()
        if len({name for name, _, _ in group}) > 1
    }


def _steps(runs: Sequence[Finished]) -> Iterator[Figure]:
    for rest, group in _curves(runs, "step").items():
        signal = SIGNALS[SCENARIOS[rest].signal if rest in SCENARIOS else "position"]
        curves = [
            Curve(label, columns["t [s]"], from_si(columns[signal.name], signal.unit, signal.si))
            for label, columns in group
            if signal.name in columns
        ]
        commands = [Curve(label, c["t [s]"], c["command"]) for label, c in group if "command" in c]
        yield Figure(f"Step: {rest}", "time [s]", [Panel(signal.label, curves), Panel("command [1]", commands)])


def _bodes(runs: Sequence[Finished]) -> Iterator[Figure]:
    for rest, group in _curves(runs, "sine").items():
        curves = [FrequencyCurve(label, c["f_hz"], c["real"] + 1j * c["imag"]) for label, c in group]
        yield bode(f"Closed loop by stepped sine, {rest}", curves)
    for rest, group in _curves(runs, "linear").items():
        curves = [FrequencyCurve(n, c["f_hz"], c["closed_real"] + 1j * c["closed_imag"]) for n, c in _low(group)]
        yield bode(" ".join(("Closed loop, linear at null", rest)).strip(), curves)
    for table in dict.fromkeys(name for run in runs for name in run.tables):
        sharing = [(run.name, run.read(table)) for run in runs if table in run.tables]
        curves = [
            FrequencyCurve(name, c["f_hz"], 10 ** (c["gain_db"] / 20) * np.exp(1j * np.radians(c["phase_deg"])))
            for name, c in sharing
            if {"f_hz", "gain_db", "phase_deg"} <= c.keys()
        ]
        if len(curves) > 1:
            yield bode(table, curves)


def _sensitivity(runs: Sequence[Finished]) -> Iterator[Figure]:
    for rest, group in _curves(runs, "linear").items():
        curves = [
            Curve(label, c["f_hz"], gain_db(c["sensitivity_real"] + 1j * c["sensitivity_imag"])) for label, c in group
        ]
        title = " ".join(("Sensitivity at null", rest)).strip()
        yield Figure(title, "frequency [Hz]", [Panel("|S| [dB]", curves)], log_x=True)


def _low(group: Sequence[tuple[str, dict[str, np.ndarray]]]) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    for label, columns in group:
        yield label, {name: values[columns["f_hz"] < _SHOWN_HZ] for name, values in columns.items()}


def _residuals(runs: Sequence[Finished]) -> Iterator[Figure]:
    """Errors of the records that runs share, one panel a signal."""
    for record, group in _curves(runs, "residual").items():
        heads = dict.fromkeys(head for _, columns in group for head in columns if head.startswith("error "))
        panels = [Panel(head, [Curve(label, c["t [s]"], c[head]) for label, c in group if head in c]) for head in heads]
        yield Figure(f"Error: {record}", "time [s]", panels)


def _bars(runs: Sequence[Finished], rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Where there are no curves: the differences in percent, row by row."""
    count = np.arange(1, len(rows) + 1)
    curves = [
        Curve(run.name, count, np.array([row["percent"].get(run.name) for row in rows], dtype=float), "markers")
        for run in runs[1:]
    ]
    return Figure("Differences", "row", [Panel(f"difference from {runs[0].name} [%]", curves)])
