"""The leading designs of a search, played on the rig, which decides."""

from collections.abc import Sequence

import numpy as np

from ...base.checkpoint import Progress
from ...control.controller_spec import ControllerSpec
from ...rigs.rig import Rig
from ..judged import Judged, wire_rig
from .allowed import allowed
from .rig_time import RigTime
from .verify import Way, foretold, played_way, predicted_of, settling_of

_Rank = tuple[bool, bool, float]  # settled not everywhere, not foretold, settling [s]


def rig_decides(
    spent: RigTime, model: Rig, designs: Sequence[ControllerSpec], goal: str, number: int, say: Progress
) -> ControllerSpec:
    """The design for a `model` that did the goal soonest on the rig. One that settled wherever the goal began comes
    before all that did not, and of those one whose settling was foretold. Once one was cut short, or the rig's time is
    over, no further one is played."""
    if len(designs) == 1:
        return designs[0]
    plants, trips, ranks = allowed(wire_rig(model, spent.client)), len(spent.trips), list[_Rank]()
    for place, spec in enumerate(designs, 1):
        judged = played_way(spent, f"leading-{place}", Way(spec, plants), (goal,), say, number)
        ranks.append(_rank(judged, goal))
        if spent.over or len(spent.trips) > trips:
            break
    best = min(range(len(ranks)), key=ranks.__getitem__)
    say(f"of {len(ranks)} designs the rig does {goal} best with number {best + 1}")
    return designs[best]


def _rank(judged: Sequence[Judged], goal: str) -> _Rank:
    measured = settling_of(judged, goal)
    everywhere = bool(judged) and all(each.row["settling_s"] is not None for each in judged)
    return not everywhere, not foretold(predicted_of(judged, goal), measured), np.inf if measured is None else measured
