"""The page of what a jack can do."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...identify.acceptance.row import Row
from ...loop.performance.bounds import BOUNDS, PerformanceEnvelope
from ...loop.performance.drive import CatalogueValve, Choice, smallest
from ...loop.performance.reached import NEAR, SHARES, Reached
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...report.table import Cell
from ..common.sheet_page import sheet_page
from .config import CapabilityAsked, DriveAsked
from .found import Findings
from .pictures import LENGTH, followed_curves, force_picture, motions, reached_curves, speeds, tripartite

_HOW = (
    "A sine of the position at mid stroke, by the model: its force by the linear model of what the jack carries, the "
    "opening of the lands by the pressure drop that this force leaves, the valve by its response to full command. "
    "Intervals cover the bounds of the rig's numbers, to first order, with the valve's response as declared."
)
PLAYED = (
    "The engine was asked in the middle of each span: a command learned cycle by cycle. A sine counts as reached where "
    f"its speed or acceleration, whichever is bound, is off by {100 * NEAR:g} % at most, and no chamber is empty."
)
_THERMAL = (
    "The lands' flow with their leakage, without the pilot's; a pump that gives what is drawn, without its own losses. "
    "Work that the jack passes on is not heat."
)
_PER_MINUTE, _LITRES = 60000.0, 1e3


def capability_page(asked: CapabilityAsked, found: Findings, rows: Sequence[Row]) -> tuple[Page, Figure]:
    """The page and its telling figure, the envelope."""
    picture = _picture(asked, found)
    sections = [
        Section(
            "Envelope",
            [picture, spans_table(found.envelope), motions(found.envelope, LENGTH), force_picture(found.envelope)],
        )
    ]
    if found.reached:
        sections.append(Section("Asked of the engine", [_reached(found.reached), PLAYED]))
    if asked.drive is not None:
        sections.append(Section("The drive file", _drive(asked.drive, found)))
    page = sheet_page(f"What {asked.rig.name} can do", asked.made, rows, sections, _HOW)
    words = ", ".join(f"{name} to {high:.3g} Hz" for name, _, high in found.envelope.spans())
    choice = _choices_in_words(found)
    return replace(page, verdict=f"Bound by {words}.{choice} {page.verdict}"), picture


def spans_table(whole: PerformanceEnvelope) -> Table:
    """What binds from where to where, in words."""
    rows = [[name, low, high, BOUNDS[name]] for name, low, high in whole.spans()]
    return Table("What binds", ["bound", "from [Hz]", "to [Hz]", "meaning"], rows)


def _picture(asked: CapabilityAsked, found: Findings) -> Figure:
    more: list[Curve] = []
    if found.followed is not None and found.loop is not None:
        name, own = found.loop.name, found.followed
        more += followed_curves(name, own)
        more.append(speeds(f"{name} with amplitude and phase control", own.f, own.control, "points"))
    more += reached_curves(found.reached)
    more += [speeds(f"measured, {name}", sines[:, 0], sines[:, 1], "markers") for name, sines in found.measured.items()]
    note = f"shares of the envelope that were played: {', '.join(f'{share:g}' for share in SHARES)}"
    title = f"Largest sines of {asked.rig.name}"
    return tripartite(title, found.envelope, LENGTH, more, note if found.followed else "")


def _reached(points: Sequence[Reached]) -> Table:
    head = [
        "frequency [Hz]",
        "amplitude [mm]",
        "bound",
        "off it by [%]",
        "lowest chamber [bar]",
        "reached",
        "stopped by",
    ]
    return Table("Inside and outside", head, [reached_cells(point, 1e3) for point in points])


def reached_cells(point: Reached, scale: float) -> list[Cell]:
    """Frequency, amplitude times `scale`, bound, how far off [%], lowest pressure [bar], whether reached, what stopped
    it."""
    off, lowest = _finite(100 * point.off), _finite(point.lowest / 1e5)
    return [point.f, scale * point.amplitude, point.bound, off, lowest, _yes(point.there), point.told]


def _yes(holds: bool) -> str:
    return "yes" if holds else "no"


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _drive(drive: DriveAsked, found: Findings) -> list[Figure | Table | str]:
    need = found.demands
    assert need is not None
    panels = [
        Panel("position [mm]", [Curve("position", need.t, 1e3 * need.position)]),
        Panel("power [kW]", [Curve("power", need.t, need.power / 1e3)]),
        Panel("opening [%]", [Curve("opening", need.t, 100 * np.sign(need.oil) * need.lands.opening)]),
    ]
    parts: list[Figure | Table | str] = [Figure(f"What {drive.name} takes", "time [s]", panels)]
    if found.valves:
        parts.append(_choices("Valves, each in place of each of the rig's", found.valves))
    if found.pumps:
        parts.append(_choices("Pumps, with the accumulator that they need", found.pumps))
    return [*parts, _THERMAL]


def _choices(title: str, choices: Sequence[Choice]) -> Table:
    """A valve's flow is at one drop, and a pump has its accumulator."""
    valves = all(isinstance(choice.entry, CatalogueValve) for choice in choices)
    last = "bandwidth [Hz]" if valves else "accumulator [l]"
    head = ["name", "flow [l/min]", last, "takes of it [%]", "suffices", "fails by", "price", "order"]
    rows = []
    for choice in choices:
        entry = choice.entry
        if isinstance(entry, CatalogueValve):
            own = [entry.rated * _PER_MINUTE, entry.bandwidth]
        else:
            own = [entry.flow * _PER_MINUTE, None if choice.accumulator is None else _LITRES * choice.accumulator]
        verdict = [_finite(100 * choice.used), _yes(not choice.fails), choice.fails]
        rows.append([entry.name, *own, *verdict, entry.price, entry.order])
    note = "From the smallest on." + (" Flow at 70 bar over both lands." if valves else "")
    return Table(title, head, rows, note)


def _choices_in_words(found: Findings) -> str:
    words = ""
    for what, choices in (("valve", found.valves), ("pump", found.pumps)):
        if choices:
            own = smallest(choices)
            words += (
                f" No {what} of the catalogue does the drive file."
                if own is None
                else (f" The smallest {what} that does the drive file: {own.entry.name}.")
            )
    return words
