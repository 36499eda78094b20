"""Of the drawn plants of an envelope those that are hardest on a controller: many are judged, the worst are kept."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..control.protocol import Controller, graph_law
from .envelope import Envelope, steps
from .limits import Limits
from .plant_lanes import PlantLanes
from .scenarios import Scenario

_CHUNK = 200  # plants linearised at a time: their responses take half a megabyte each


def hardest(
    envelope: Envelope, controller: Controller, scenarios: Sequence[Scenario], count: int, limits: Limits
) -> list[list[int]]:
    """Numbers of the `count` hardest drawn plants by kind, the hardest first, in the seconds that `limits` watch.

    Kinds: the largest Ms, and in each scenario without noise the slowest to settle, the largest overshoot, and the
    largest Ms with what the controller has measured; what is unstable, trips or hunts is harder than all others. A
    controller that does not run in lanes is judged by Ms alone.
    Raises InputError for a controller without a linear view.
    """
    if envelope.drawn is None:
        return []
    kinds = [largest_ms(envelope.drawn, controller)]
    if graph_law(controller) is not None:
        kinds += _in_motion(envelope.drawn, controller, scenarios, limits)
    return [np.argsort(-kind, kind="stable")[:count].tolist() for kind in kinds]


def largest_ms(lanes: PlantLanes, controller: Controller, remembered: np.ndarray | None = None) -> np.ndarray:
    """Ms [lanes] of the worse of null and moving, inf where a loop is unstable, with what the controller has in its
    memory [lanes, m]. Raises InputError as `hardest`."""
    parts = []
    for first in range(0, len(lanes.p), _CHUNK):
        chunk = lanes.some(range(first, min(first + _CHUNK, len(lanes.p))))
        kept = None if remembered is None else remembered[first : first + _CHUNK]
        parts.append(np.max([np.nan_to_num(each.ms, nan=np.inf) for each in chunk.margins(controller, kept)], axis=0))
    return np.concatenate(parts)


def _in_motion(
    lanes: PlantLanes, controller: Controller, scenarios: Sequence[Scenario], limits: Limits
) -> Iterator[np.ndarray]:
    for scenario in scenarios:
        calm = steps(lanes, controller, scenario, None, limits.seconds, limits.moves)
        lost = calm.tripped | calm.hunting
        yield np.where(lost, np.inf, np.nan_to_num(calm.settling, nan=limits.seconds))
        if scenario.size:
            yield np.where(lost, np.inf, np.nan_to_num(calm.overshoot, nan=np.inf))
        if calm.remembered is not None and scenario.moves_alone:
            yield largest_ms(lanes, controller, calm.remembered)
