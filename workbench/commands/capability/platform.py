"""The sheet of what a platform can do: the envelope of each axis about home, from those of its legs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.platform_controller import PlatformSpec
from ...identify.acceptance.bench import TestBench
from ...identify.acceptance.row import AcceptanceLimit, Row, judged
from ...loop.describing_function import sampled_frequencies
from ...loop.drive_simulation import drive
from ...loop.performance.bounds import Drive, PerformanceEnvelope, envelope, weakest
from ...loop.performance.carried import carried_along, platform_axes
from ...loop.performance.reached import Followed, Reached
from ...loop.platform.reached import reached_along
from ...loop.platform.rows import followed_along
from ...loop.platform.setup import PlatformSetup, platform_setup
from ...loop.rows import loop_setup
from ...report import Curve, Figure, Page, Section, Table
from ...rigs.platform import AXES, Platform
from ..common.outcome import Outcome, Progress, Stage
from ..common.sheet_options import Made
from ..common.sheet_page import sheet_page
from .figures import FREQUENCIES, spoken
from .page import PLAYED, reached_cells, spans_table
from .pictures import ANGLE, LENGTH, Shown, followed_curves, reached_curves, tripartite
from .study import CHECKED, FOLLOWED, checked_points, followed_row, told
from .tuned import seeing, self_tuned

LOWEST, HIGHEST, POINTS = 0.1, 100.0, 60  # Hz, of a curve
FROM, PLAYED_POINTS = 0.2, 14  # Hz, from where a loop is played
_BLIND = "a leg has no position sensor, which its loop needs"
_SHOWN = {"m": LENGTH, "rad": ANGLE}
_HOW = (
    "A sine along one axis about home, by the model: each leg's travel by the Jacobian there, its force by the inertia "
    "of payload and legs on top of their weight. An axis goes as far as its weakest leg: what its lands give at the "
    "pressure drop that this force leaves, by its stroke, speed, force, valve and command rate. "
    "These lines have no interval. Low and high of what a loop follows are the frequencies that were played."
)


@dataclass(frozen=True)
class LegLoops:
    """For each leg a slow loop that holds it, and one that tunes itself on its model; or `why` there are none."""

    slow: Sequence[ControllerSpec]
    tuned: Sequence[ControllerSpec]
    why: str = ""


@dataclass(frozen=True, eq=False)
class AxisPlayed:
    """Along one axis: sines that the engine was asked for, and what a loop follows of the envelope."""

    reached: Sequence[Reached]
    followed: Followed | None


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


def _along(setup: PlatformSetup, axis: str, drives: list[Drive], f: np.ndarray) -> PerformanceEnvelope:
    legs = carried_along(setup, axis, f)
    return weakest([envelope(leg, drive) for leg, drive in zip(legs, drives, strict=True)])


def _rows(axis: str, si: str, own: PerformanceEnvelope) -> list[Row]:
    """By the model as it is declared: no interval."""
    unit, scale = _SHOWN[si].unit, _SHOWN[si].scale
    rows = []
    for f, bound, amplitude in zip(own.f.tolist(), own.binding, own.amplitude.tolist(), strict=True):
        meaning, size = f"largest sine of {axis} at {f:g} Hz, bound by {bound}", scale * amplitude
        rows.append(Row(f"{axis}_{spoken(f)}", meaning, unit, size, size, size))
    return rows


def _page(
    platform: Platform,
    made: Made,
    whole: Mapping[str, PerformanceEnvelope],
    rows: list[Row],
    asked: Mapping[str, AxisPlayed],
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


def leg_loops(setup: PlatformSetup) -> LegLoops:
    """The loops of the legs; those of legs alike are computed once."""
    slow, tuned = dict[int, ControllerSpec](), dict[int, ControllerSpec | str]()
    for leg, rig in zip(setup.platform.legs, setup.guarded, strict=True):
        if id(leg.rig) not in slow:
            blind = "position" not in leg.rig.sensors
            slow[id(leg.rig)] = drive(seeing(rig)).loop
            tuned[id(leg.rig)] = _BLIND if blind else self_tuned(loop_setup(rig))
    specs = [tuned[id(leg.rig)] for leg in setup.platform.legs]
    why = next((spec for spec in specs if isinstance(spec, str)), "")
    own = () if why else tuple(spec for spec in specs if isinstance(spec, ControllerSpec))
    return LegLoops(tuple(slow[id(leg.rig)] for leg in setup.platform.legs), own, why)


def played(
    setup: PlatformSetup,
    loops: LegLoops,
    axis: str,
    along: Callable[[np.ndarray], PerformanceEnvelope],
    whole: PerformanceEnvelope,
) -> AxisPlayed:
    """A sine inside and one outside each bound, and the loop; `along`: the axis's envelope at frequencies [k] Hz."""
    seen = setup if loops.tuned else platform_setup(setup.platform.with_rigs(seeing))
    points = checked_points(whole, partial(reached_along, seen, loops.slow, axis))
    if not loops.tuned:
        return AxisPlayed(points, None)
    period = setup.platform.period
    at = sampled_frequencies(FROM, min(CHECKED[1], 0.05 / period), PLAYED_POINTS, period)
    controller = PlatformSpec("automatic", tuple(loops.tuned)).build(period, setup.directions)
    return AxisPlayed(points, followed_along(setup, controller, axis, at, along(at).amplitude))


def followed_rows(asked: Mapping[str, AxisPlayed], loops: LegLoops) -> list[Row]:
    """Rows of the frequency up to which a loop follows each axis."""
    how = "up to there with a part of the envelope"
    return [
        followed_row(
            f"{axis}_followed_{kind}",
            f"legs that tune themselves follow sines of {axis} {how}: {what}",
            own.followed,
            kind,
            FROM,
            loops.why,
        )
        for axis, own in asked.items()
        for kind, what in FOLLOWED.items()
    ]


def reached_table(asked: Mapping[str, AxisPlayed], units: Mapping[str, Shown]) -> Table:
    """Inside and outside, axis by axis."""
    head = ["axis", "frequency [Hz]", "amplitude", "unit", "bound", "off it by [%]", "lowest chamber [bar]", "reached"]
    rows = []
    for axis, own in asked.items():
        for point in own.reached:
            f, amplitude, *rest = reached_cells(point, units[axis].scale)
            rows.append([axis, f, amplitude, units[axis].unit, *rest[:-1]])
    return Table("Inside and outside", head, rows)


def curves(own: AxisPlayed, shown: Shown) -> list[Curve]:
    """What was played, on the picture of an axis."""
    followed = followed_curves("loop", own.followed, shown) if own.followed else []
    return [*followed, *reached_curves(own.reached, shown)]
