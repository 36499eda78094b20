"""Hard goals of a loop over its envelope: by how much each is met, where the worst lies, and which of the drawn plants
are hardest on a controller: many are judged, the worst are kept.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..control.protocol import Controller, graph_law
from .envelope import Envelope, LinearWorst, command_noise, steps
from .metrics import METRICS
from .plant_lanes import PlantLanes
from .scenarios import Limits, Scenario
from .sensors import settling_band

_NO_NUMBER = 1e3  # how far a goal is missed whose number does not exist
_CHUNK = 200  # plants linearised at a time: their responses take half a megabyte each


@dataclass(frozen=True)
class Goal:
    """A goal: its `value` and the `limit`, None for one that is met or not; the plant on which it is worst.

    miss: how far it is missed, 0 where it is met. metric: the key of what is limited, "" where nothing is.
    """

    name: str
    value: float | None
    limit: float | None
    where: str
    miss: float
    metric: str = ""


def linear_goals(envelope: Envelope, controller: Controller, limits: Limits) -> Iterator[Goal]:
    """The goals of the linear loops at null and moving. Raises InputError for a controller without a linear view."""
    (varied, margins), *others = envelope.margins(controller)
    nominal = varied.some(np.flatnonzero(envelope.nominal).tolist())
    every = [LinearWorst.of(lanes, loops) for lanes, loops in ((varied, margins), *others)]
    growth = sum(each.growth for each in every)
    unstable = [each.plant for each in every if each.growth]
    yield Goal("stable on every plant", None, None, unstable[0] if unstable else "", growth * 1e3)
    at_nominal = LinearWorst.of(nominal, [each.some(envelope.nominal) for each in margins])
    for key, limit in (("ms", limits.ms_nominal), ("gain_margin_db", limits.gain_margin_db)):
        yield _limited(key, "{} on the nominal rig", getattr(at_nominal, key), limit, at_nominal.plant)
    worst = max(every, key=lambda each: np.nan_to_num(each.ms, nan=np.inf))  # the unstable one, where there is one
    yield _limited("ms", "{} on every plant", worst.ms, limits.ms, worst.plant)


def motion_goals(
    envelope: Envelope, controller: Controller, scenarios: Sequence[Scenario], limits: Limits
) -> Iterator[Goal]:
    """On the nonlinear plant: the command's noise at rest, no trip and no hunting in the scenarios, the overshoot, and
    little left of a load; stability and Ms of a controller that stands with what it has measured in them."""
    lanes = envelope.played(controller)
    noise = command_noise(lanes, controller, scenarios[0].signal)
    yield _worst("command_rms", "{}", noise, limits.command_rms, lanes)
    for scenario in scenarios:
        calm, own = steps(lanes, controller, scenario, None, limits.seconds, limits.moves), f"{scenario.name}: {{}}"
        for what, lost in (("trips", calm.tripped), ("hunts", calm.hunting)):
            where = lanes.names[int(np.argmax(lost))] if lost.any() else ""
            yield Goal(f"{scenario.name}: nowhere {what}", None, None, where, float(lost.sum()))
        if scenario.size and np.isfinite(limits.overshoot_percent):
            yield _worst("overshoot_percent", own, calm.overshoot, limits.overshoot_percent, lanes)
        if scenario.load and not scenario.size and np.isfinite(limits.load_left):
            nominal, band = envelope.are_nominal(lanes.names), settling_band(lanes.rig, scenario.signal, 0.0)
            some = lanes.some(np.flatnonzero(nominal).tolist())
            yield _worst("load_left", own, calm.left[nominal] / band, limits.load_left, some)
        if calm.remembered is not None and scenario.moves_alone:
            held = LinearWorst.of(lanes, lanes.margins(controller, calm.remembered))
            where = held.plant if held.growth else ""
            yield Goal(f"{scenario.name}: stable with what it has measured", None, None, where, held.growth * 1e3)
            yield _limited("ms", f"{own} with what it has measured", held.ms, limits.ms, held.plant)


def _worst(key: str, name: str, values: np.ndarray, limit: float, lanes: PlantLanes) -> Goal:
    """The goal of a metric on many lanes, where it is worst."""
    worst = METRICS[key].worst(values)
    return _limited(key, name, float(values[worst]), limit, lanes.names[worst])


def _limited(key: str, name: str, value: float, limit: float, where: str) -> Goal:
    """The goal of a metric, in whose `name` {} stands for the metric's. A number that does not exist misses by more
    than any other."""
    of = METRICS[key]
    miss = _NO_NUMBER if np.isnan(value) else max(0.0, of.beyond(value, limit) / limit)
    unit = f" [{of.unit}]" if of.unit != "1" else ""
    return Goal(f"{name.format(of.name)}{unit}", value, limit, where, miss, key)


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
