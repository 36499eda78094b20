"""What is played along the axes of a platform: sines inside and outside each bound, and what a loop follows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.platform_controller import PlatformSpec
from ...identify.acceptance.row import Row
from ...loop.describing_function import sampled_frequencies
from ...loop.drive_simulation import drive
from ...loop.performance.bounds import Envelope
from ...loop.performance.reached import Followed, Reached
from ...loop.platform.reached import reached_along
from ...loop.platform.rows import followed_along
from ...loop.platform.setup import PlatformSetup, platform_setup
from ...loop.rows import loop_setup
from ...report import Curve, Table
from .page import reached_cells
from .pictures import Shown, followed_curves, reached_curves
from .study import CHECKED, FOLLOWED, INSIDE, OUTSIDE, checked_spans, followed_row
from .tuned import seeing, self_tuned

FROM, POINTS = 0.2, 14  # Hz, from where a loop is played
_BLIND = "a leg has no position sensor, which its loop needs"


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
    setup: PlatformSetup, loops: LegLoops, axis: str, along: Callable[[np.ndarray], Envelope], whole: Envelope
) -> AxisPlayed:
    """A sine inside and one outside each bound, and the loop; `along`: the axis's envelope at frequencies [k] Hz."""
    seen = setup if loops.tuned else platform_setup(setup.platform.with_rigs(seeing))
    points = [
        reached_along(seen, loops.slow, axis, f, share * most, bound)
        for bound, f, most in checked_spans(whole)
        for share in (INSIDE, OUTSIDE)
    ]
    if not loops.tuned:
        return AxisPlayed(points, None)
    period = setup.platform.period
    at = sampled_frequencies(FROM, min(CHECKED[1], 0.05 / period), POINTS, period)
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
