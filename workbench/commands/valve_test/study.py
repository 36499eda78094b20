"""A valve's sheet: read off a campaign's records, or off those that its test bench plays."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...base.units import from_si
from ...identify.acceptance.bench import TestBench
from ...identify.acceptance.dynamics import SINES, STEPS, ResponseEstimate, corner_rows
from ...identify.acceptance.excitations import VALVE_TELLS, missing_records
from ...identify.acceptance.flow_curve import FlowCurve
from ...identify.acceptance.null_shift import State, by_supply, by_temperature, null_shift
from ...identify.acceptance.row import Estimate, Row, judged, measured, unsaid
from ...identify.acceptance.valve_test import SUPPLY, TEMPERATURE, ValveSheet, valve_sheet
from ...report import Curve, Figure, FrequencyCurve, Page, Panel, Section, bode
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.sheet_options import Asked
from ..common.sheet_page import sheet_page

_SHIFT = 0.2  # of the supply, either way, for the null shift
_PER_MINUTE = 60000.0
_RECORDED = (
    "In the manner of ISO 10770-1. Flow from the piston's speed is less what compresses the oil and what leaks past "
    "the piston, by the rig file's numbers within their bounds, and is brought to 35 bar a land by the measured "
    "pressures."
)
_PLAYED = (
    "In the manner of ISO 10770-1, played by the engine on the rig file's model: load ports at 35 bar and lands fed at "
    "70 bar; blocked ports at the rig's supply for pressure gain and leakage. Sensors have the noise that the file "
    "declares, the flow meter 0.1 % of the rated flow a sample."
)


def run_valve_test(sheet: Asked, stage: Stage, progress: Progress) -> Outcome:
    """`rows` of the sheet; the curve and the responses as tables."""
    progress("records" if sheet.campaign else "the valve on its test bench")
    found = _recorded(sheet) if sheet.campaign else played_sheet(TestBench(sheet.rig, sheet.seed), progress)
    rows = judged(found.rows, sheet.limits)
    found = replace(found, rows=rows)
    tables = {f"response_{name}": _columns(response) for name, response in found.responses.items()}
    if found.curve is not None:
        low, high = found.curve.band()
        tables["flow_curve"] = {"command": found.curve.command, "flow": found.curve.flow, "low": low, "high": high}
    missing = list(missing_records(rows, VALVE_TELLS)) if sheet.campaign else []
    metrics = {"rows": [row.table() for row in rows], "missing": missing}
    return Outcome(metrics, lambda: valve_page(sheet, found, missing), tables, subject=Subject(sheet.rig), dated=False)


def _recorded(sheet: Asked) -> ValveSheet:
    assert sheet.campaign is not None
    own = sheet.campaign
    found = valve_sheet((*own.train, *own.select, *own.heldout), sheet.rig)
    states = {SUPPLY: by_supply(own, sheet.rig), TEMPERATURE: by_temperature(own, sheet.rig)}
    shifts = {line.id: null_shift(line, each) for line, each in states.items() if len(each) > 1}
    found = replace(found, rows=[shifts.get(row.id, row) for row in found.rows])
    shows = "the rig's records do not show its pilot by itself"
    lacks = shows if sheet.rig.valve_kind.has_pilot else _no_pilot(sheet.rig)
    return replace(found, rows=[*found.rows, *_pilot(sheet.rig, {}, None, lacks)])


def played_sheet(bench: TestBench, progress: Progress) -> ValveSheet:
    """All that the bench can play, with the frequency responses by stepped sine."""
    records = bench.flow_records() + [bench.pressure_record()] + [bench.step_record(size) for size in STEPS]
    found = valve_sheet(records, bench.rig)
    responses = {}
    for size in SINES:
        progress(f"main stage, {size} %: stepped sine")
        responses[f"main_{size}"] = bench.metered_response("main", size)
    has_pilot = bench.rig.valve_kind.has_pilot
    for size in SINES if has_pilot else ():
        progress(f"pilot, {size} %: stepped sine")
        responses[f"pilot_{size}"] = bench.metered_response("pilot", size)
    rows = [row for row in found.rows if not row.id.startswith(tuple(f"main_{size}_" for size in SINES))]
    for size in SINES:
        rows += corner_rows(responses[f"main_{size}"], f"main_{size}", f"main stage, {size} %", "")
    rows = [
        _shift(bench) if row.id == "null_shift_supply" else row for row in rows if not row.id.startswith("main_small")
    ]
    rows += _pilot(bench.rig, responses, bench.pilot_flow() if has_pilot else None, _no_pilot(bench.rig))
    return replace(found, rows=rows, responses=responses)


def _no_pilot(rig: Rig) -> str:
    return f"a {rig.valve} valve has no pilot"


def _pilot(rig: Rig, responses: dict[str, ResponseEstimate], flow: tuple[float, float] | None, lacks: str) -> list[Row]:
    lines = [
        row
        for size in SINES
        for row in corner_rows(responses.get(f"pilot_{size}"), f"pilot_{size}", f"pilot, {size} %", lacks)
    ]
    meaning = "pilot flow at rated current and 70 bar valve drop"
    if flow is None:
        return [*lines, unsaid("pilot_flow", meaning, "l/min", lacks)]
    return [*lines, measured("pilot_flow", meaning, "l/min", Estimate(*flow), _PER_MINUTE)]


def _shift(bench: TestBench) -> Row:
    """The null of the bench at supplies above and below the rig's."""
    rigs = [bench.rig.with_values(Ps=share * bench.rig["Ps"]) for share in (1 - _SHIFT, 1 + _SHIFT)]
    return null_shift(SUPPLY, [State(rig["Ps"], TestBench(rig, bench.seed).flow_records(), rig) for rig in rigs])


def _columns(response: ResponseEstimate) -> dict:
    """Columns of a response for its parquet."""
    return {
        "f_hz": response.f,
        "real": np.real(response.response),
        "imag": np.imag(response.response),
        "radius": response.radius,
    }


def valve_page(sheet: Asked, found: ValveSheet, missing: Sequence[str]) -> tuple[Page, Figure | None]:
    """The page and its telling figure, the flow curve; `missing`: records of a test that the campaign lacks."""
    figure = None if found.curve is None else _curve(found.curve)
    sections = [Section("Flow over command", [figure])] if figure is not None else []
    if found.responses:
        curves = [
            FrequencyCurve(
                name.replace("_", " ") + ("" if name.endswith("small") else " %"),
                r.f,
                r.response / abs(r.response[0]),
                "points",
            )
            for name, r in found.responses.items()
        ]
        sections.append(Section("Frequency response", [bode("Flow or spool over command", curves)]))
    how = _RECORDED if sheet.campaign else _PLAYED
    if missing:
        how += f" Records that would tell more: {', '.join(missing)}; jackbench excite RIG valve-test designs them."
    return sheet_page(f"Valve sheet: {sheet.name}", sheet.made, found.rows, sections, how), figure


def _curve(curve: FlowCurve) -> Figure:
    low, high = (from_si(edge, "l/min", "m^3/s") for edge in curve.band())
    flow = from_si(curve.flow, "l/min", "m^3/s")
    panels = [
        Panel("flow [l/min]", [Curve("flow", 100 * curve.command, flow, "points", band=(low, high))]),
    ]
    title = f"Flow of one valve at 70 bar valve drop, by {curve.source}"
    return Figure(title, "command [%]", panels)
