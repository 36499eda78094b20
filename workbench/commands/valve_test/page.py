"""The page of a valve's sheet: its lines, the flow curve, and the frequency responses."""

from collections.abc import Sequence

from ...base.units import from_si
from ...identify.acceptance.flow_curve import FlowCurve
from ...identify.acceptance.valve_test import ValveSheet
from ...report import Curve, Figure, FrequencyCurve, Page, Panel, Section, bode
from ..common.sheet_options import Asked
from ..common.sheet_page import sheet_page

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
