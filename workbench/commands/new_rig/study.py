"""A rig from a datasheet: its figures before and after the fit, and what they leave undetermined."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.units import from_si
from ...identify.datasheet.corners import corner_frequencies, rated_flow
from ...identify.datasheet.valve_fit import ValveFit, fit_three_stage, second_order_numbers
from ...identify.fit.determined import DETERMINED, FIGURE_ERROR
from ...report import Curve, Figure, FrequencyCurve, Page, Panel, Section, Table, bode
from ...rigs.datasheet import Datasheet, DatasheetResponse, build_rig
from ...rigs.number import Number
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage

STARTS = 3  # of the fit: the estimates, then random places
TOLERANCE = 0.02  # a start whose figures are all this near the datasheet ends the search
POINTS = 30  # a curve, before its corners are refined
_CORNERS = (("f3db", -3.0), ("f90", -90.0))


@dataclass(frozen=True)
class _Measured:
    """Figures of a rig by id [Hz, l/min], and its curves: f [Hz] and response, by the id of the sheet's response."""

    figures: Mapping[str, float | None]
    curves: Mapping[str, tuple[np.ndarray, np.ndarray]]


def identity(sheet: Datasheet) -> dict[str, Any]:
    """What says that a rig is built from the same datasheet: the file as it was read, and the geometry."""
    return {"datasheet": sheet.read, "geometry": sheet.geometry.table() if sheet.geometry else None}


def rig_of(sheet: Datasheet, stage: Stage, progress: Progress) -> tuple[Rig, ValveFit | None]:
    """A rig with the sheet's figures, and the fit that a three-stage valve needs."""
    if sheet.geometry is None:
        return build_rig(sheet, second_order_numbers(sheet)), None
    fit = fit_three_stage(sheet, STARTS, TOLERANCE, stage, progress)
    return fit.rig, fit


def run_new_rig(sheet: Datasheet, stage: Stage, progress: Progress) -> tuple[Outcome, Rig]:
    """A rig with the sheet's figures, fitted where the valve has three stages; the outcome, and the rig to save."""
    rig, fit = rig_of(sheet, stage, progress)
    progress("figures of the rig")
    after = _measure(sheet, rig, stage, "rig")
    before = _measure(sheet, fit.estimate, stage, "estimates") if fit else None
    rows = _rows(sheet, after, before)
    metrics: dict[str, Any] = {"rows": rows}
    if fit:
        metrics |= {"determined": _determined(fit), "parameters": _parameters(fit)}
    tables = {
        name: {"f_hz": f, "gain_db": gain_db(response), "phase_deg": phase_deg(response)}
        for name, (f, response) in after.curves.items()
    }

    def draw() -> tuple[Page, Figure]:
        bodes = [_bode(response, after, before) for response in sheet.responses]
        sections = _sections(rig, rows, fit, bodes)
        return Page(f"{sheet.name}: a rig from a datasheet", _verdict(sheet, rows, fit), sections), bodes[-1]

    return Outcome(metrics, draw, tables, subject=Subject(rig)), rig


def _measure(sheet: Datasheet, rig: Rig, stage: Stage, label: str) -> _Measured:
    """Every figure of the sheet, measured on the rig's benches."""
    figures: dict[str, float | None] = {}
    curves = {}
    for response in sheet.responses:

        def compute(response: DatasheetResponse = response) -> dict[str, Any]:
            sine, f3db, f90 = corner_frequencies(rig, response, POINTS)
            flow = sine.response["flow"]
            return {"f": sine.f, "real": np.real(flow), "imag": np.imag(flow), "f3db": f3db, "f90": f90}

        stored = stage(f"{label} {response.id}", compute)
        figures |= {f"{response.id}_{key}": stored[key] for key, _ in _CORNERS}
        curves[response.id] = (np.asarray(stored["f"]), stored["real"] + 1j * stored["imag"])
    for part in sheet.valve_kind.stages:
        flow = rated_flow(rig, part, sheet.valve["rated_drop"])
        figures[f"{part}_flow"] = float(from_si(flow, "l/min", "m^3/s"))
    return _Measured(figures, curves)


def _rows(sheet: Datasheet, after: _Measured, before: _Measured | None) -> list[dict[str, Any]]:
    """One row a figure; `estimate` is what the rig had before the fit."""
    stated_figures = {f"{r.id}_{key}": ("Hz", getattr(r, key)) for r in sheet.responses for key, _ in _CORNERS}
    for part, key in (("pilot", "pilot_flow"), ("main", "rated_flow")):
        if key in sheet.valve:
            stated_figures[f"{part}_flow"] = ("l/min", float(from_si(sheet.valve[key], "l/min", "m^3/s")))
    rows = []
    for name, (unit, stated) in stated_figures.items():
        value = after.figures[name]
        error = None if value is None else 100 * (value / stated - 1)
        row = {"id": name, "value": value, "unit": unit, "datasheet": stated, "error_percent": error}
        rows.append(row | {"estimate": before.figures[name] if before else None})
    return rows


def _determined(fit: ValveFit) -> dict[str, Any]:
    determination = fit.determination
    return {
        "figure_error_percent": 100 * FIGURE_ERROR,
        "limit_percent": 100 * DETERMINED,
        "count": determination.count,
        "combinations": [
            {"weights": dict(c.weights), "interval_percent": 100 * c.interval, "determined": c.determined}
            for c in determination.combinations
        ],
        "numbers": {f.name: fit.rig.numbers[f.name].source for f in fit.free},
    }


def _parameters(fit: ValveFit) -> dict[str, list[float | None]]:
    """Value and 95 % interval of every number that was free, SI."""
    numbers = [fit.rig.numbers[f.name] for f in fit.free]
    return {f"{n.name} [{n.si}]": [n.value, n.low, n.high] for n in numbers}


def _verdict(sheet: Datasheet, rows: Sequence[Mapping[str, Any]], fit: ValveFit | None) -> str:
    errors = {row["id"]: abs(row["error_percent"]) for row in rows if row["error_percent"] is not None}
    missing = "" if len(errors) == len(rows) else f" {len(rows) - len(errors)} have no such corner at all."
    worst = max(errors, key=lambda name: errors[name])
    met = f"{sheet.name}: figures within {errors[worst]:.1f} % of the datasheet ({worst} is the farthest).{missing}"
    if not fit:
        return met
    own = [f.name for f in fit.free if not f.printed]
    lost = [f.name for f in fit.free if not f.printed and fit.determination.conditional[f.name] >= DETERMINED]
    return (
        f"{met} Of the {len(own)} unpublished numbers {fit.determination.count} combinations are determined to "
        f"{100 * DETERMINED:.0f} % or better; not determined: {', '.join(lost)}."
    )


def _sections(
    rig: Rig, rows: Sequence[Mapping[str, Any]], fit: ValveFit | None, bodes: Sequence[Figure]
) -> list[Section]:
    keys = ("id", "datasheet", "value", "unit", "error_percent", *(("estimate",) if fit else ()))
    heads = ("figure", "datasheet", "this rig", "unit", "difference [%]", *(("estimates, unfitted",) if fit else ()))
    note = "Load ports at 35 bar, lands fed at 70 bar; gain referred to the datasheet's reference frequency."
    figures = Table("The datasheet's figures", heads, [[row[key] for key in keys] for row in rows], note)
    sections = [Section("Figures", [figures])]
    if fit:
        sections.append(Section("What the figures determine", [_combinations(fit), _numbers(fit)]))
    estimated = [number for number in rig.numbers.values() if number.source.startswith("estimate")]
    sensors = f"Sensors are assumed: {', '.join(rig.sensors)}, 16 bits over their range, noise of 0.02 % of it."
    rest = Section("The rest of the rig", [_estimates(estimated), sensors])
    return [*sections, Section("Frequency response", bodes), rest]


def _combinations(fit: ValveFit) -> Table:
    def shown(weights: Mapping[str, float]) -> str:
        parts = sorted(((w, name) for name, w in weights.items() if abs(w) > 0.2), key=lambda part: -abs(part[0]))
        return " ".join(f"{weight:+.2f} {name}" for weight, name in parts)

    return Table(
        "Combinations of the unpublished numbers",
        ["combination", "95 % interval, +- [%]", "determined"],
        [[shown(c.weights), 100 * c.interval, c.determined] for c in fit.determination.combinations],
        note=f"Singular vectors of the figures' slopes; figures known to {100 * FIGURE_ERROR:.0f} %, printed numbers "
        "and friction anywhere in their ranges. Numbers change relatively; Knet in parts of the feedback spring's "
        f"stiffness, Pr in steps of 5 bar. Determined: known to {100 * DETERMINED:.0f} % or better.",
    )


def _numbers(fit: ValveFit) -> Table:
    rows = []
    for f in fit.free:
        n, determination = fit.rig.numbers[f.name], fit.determination
        intervals = (100 * determination.marginal[f.name], 100 * determination.conditional[f.name])
        values = [None if v is None else float(from_si(v, n.unit, n.si)) for v in (n.value, f.start, n.low, n.high)]
        rows.append([f.name, n.unit, *values, *intervals, n.source])
    return Table(
        "Numbers that were free",
        ["number", "unit", "value", "estimate", "low", "high", "95 % alone, +- [%]", "given all others", "source"],
        rows,
        note="Low and high: 95 % interval inside the range that was searched. Friction in parts of rated torque and of "
        "supply pressure on the spool.",
    )


def _estimates(numbers: Sequence[Number]) -> Table:
    return Table(
        "Rules of thumb: replace them by what you know",
        ["number", "value", "unit", "source"],
        [[number.name, number.shown, number.unit, number.source] for number in numbers],
    )


def _bode(response: DatasheetResponse, after: _Measured, before: _Measured | None) -> Figure:
    """The curves with the datasheet's corners as points."""
    curves = [FrequencyCurve("rig", *after.curves[response.id])]
    if before:
        curves.append(FrequencyCurve("estimates, unfitted", *before.curves[response.id], "dash"))
    plain = bode(f"{response.stage} stage, {100 * response.amplitude:g} % of full input", curves)
    panels = [
        _with_corner(p, getattr(response, key), level) for p, (key, level) in zip(plain.panels, _CORNERS, strict=True)
    ]
    return replace(plain, panels=panels)


def _with_corner(panel: Panel, f: float, level: float) -> Panel:
    return replace(panel, curves=[*panel.curves, Curve("datasheet", np.array([f]), np.array([level]), "markers")])
