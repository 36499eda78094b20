"""The sheet of what a platform can do: the envelope of each axis about home, from those of its legs."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from ...identify.acceptance.bench import TestBench
from ...identify.acceptance.row import AcceptanceLimit, Row, judged
from ...loop.performance.bounds import Drive, Envelope, envelope, weakest
from ...loop.performance.carried import carried_along, platform_axes
from ...loop.platform.setup import PlatformSetup, platform_setup
from ...report import Figure, Page, Section
from ...rigs.platform import AXES, Platform
from ..common.outcome import Outcome, Progress, Stage
from ..common.sheet_options import Made
from ..common.sheet_page import sheet_page
from .figures import FREQUENCIES, spoken
from .page import PLAYED, spans_table
from .pictures import ANGLE, LENGTH, tripartite
from .platform_played import AxisPlayed, curves, followed_rows, leg_loops, played, reached_table
from .study import told

LOWEST, HIGHEST, POINTS = 0.1, 100.0, 60
_SHOWN = {"m": LENGTH, "rad": ANGLE}
_HOW = (
    "A sine along one axis about home, by the model: each leg's travel by the Jacobian there, its force by the inertia "
    "of payload and legs on top of their weight. An axis goes as far as its weakest leg: what its lands give at the "
    "pressure drop that this force leaves, by its stroke, speed, force, valve and command rate. "
    "These lines have no interval. Low and high of what a loop follows are the frequencies that were played."
)


def run_platform_capability(
    platform: Platform, made: Made, limits: Mapping[str, AcceptanceLimit], stage: Stage, progress: Progress
) -> Outcome:
    """`rows`: the largest sine along each axis at each frequency, and how far a loop follows it; `envelope`: what
    binds, by axis; `reached`: what the engine says of it."""
    progress("platform at home")
    setup = platform_setup(platform)
    drives = platform.of_rigs(lambda rig: _drive(TestBench(rig, 0)))
    said = np.array([f for f in FREQUENCIES if f * platform.period <= 0.1])
    f = np.geomspace(LOWEST, min(HIGHEST, 0.1 / platform.period), POINTS)
    loops, asked = leg_loops(setup), dict[str, AxisPlayed]()
    rows, whole = list[Row](), {}
    for axis in AXES:
        progress(axis)
        whole[axis] = _along(setup, axis, drives, f)
        rows += _rows(axis, platform_axes(platform)[axis], _along(setup, axis, drives, said))
        asked[axis] = played(setup, loops, axis, partial(_along, setup, axis, drives), whole[axis])
    rows = judged([*rows, *followed_rows(asked, loops)], limits)
    spans = [
        {"axis": axis, "bound": name, "from_hz": low, "to_hz": high}
        for axis, own in whole.items()
        for name, low, high in own.spans()
    ]
    points = [{"axis": axis, **told(point)} for axis, own in asked.items() for point in own.reached]
    tables = {
        axis: {"f_hz": f, "amplitude": own.amplitude, "binding": np.array(own.binding)} for axis, own in whole.items()
    }

    def draw() -> tuple[Page, Figure]:
        return _page(platform, made, whole, rows, asked)

    metrics = {"rows": [row.table() for row in rows], "envelope": spans, "reached": points}
    return Outcome(metrics, draw, tables, dated=False)


def _drive(bench: TestBench) -> Drive:
    response = bench.response("main", 100)
    return Drive(response.f, response.response)


def _along(setup: PlatformSetup, axis: str, drives: list[Drive], f: np.ndarray) -> Envelope:
    legs = carried_along(setup, axis, f)
    return weakest([envelope(leg, drive) for leg, drive in zip(legs, drives, strict=True)])


def _rows(axis: str, si: str, own: Envelope) -> list[Row]:
    """By the model as it is declared: no interval."""
    unit, scale = _SHOWN[si].unit, _SHOWN[si].scale
    rows = []
    for f, bound, amplitude in zip(own.f.tolist(), own.binding, own.amplitude.tolist(), strict=True):
        meaning, size = f"largest sine of {axis} at {f:g} Hz, bound by {bound}", scale * amplitude
        rows.append(Row(f"{axis}_{spoken(f)}", meaning, unit, size, size, size))
    return rows


def _page(
    platform: Platform, made: Made, whole: Mapping[str, Envelope], rows: list[Row], asked: Mapping[str, AxisPlayed]
) -> tuple[Page, Figure]:
    units = {axis: _SHOWN[si] for axis, si in platform_axes(platform).items()}
    pictures = {
        axis: tripartite(f"Largest sines of {axis}", own, units[axis], curves(asked[axis], units[axis]))
        for axis, own in whole.items()
    }
    sections = [Section(axis.capitalize(), [pictures[axis], spans_table(own)]) for axis, own in whole.items()]
    if any(own.reached for own in asked.values()):
        sections.insert(0, Section("Asked of the engine", [reached_table(asked, units), PLAYED]))
    return sheet_page(f"What {platform.name} can do", made, rows, sections, _HOW), pictures["heave"]
