"""What worker processes do: the linear loops of the controllers at a place, the steps of one controller."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from time import process_time
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.protocol import Controller, graph_law
from ..batch import BatchRun, play_lanes
from ..envelope import HUNTING
from ..margins import LaneMargins
from ..sensors import settling_band
from ..step_metrics import hunting_lanes, overshoots, settling_times
from .drawn_plants import DrawnPlants, plants_by_block
from .linear_loops import Place, linear_loops, places, worst_places
from .problem import RobustnessProblem

BLOCK = 1000  # plants at a time: what they need is let go, so that memory does not grow with their number
LaneRuns = Iterable[tuple[slice, BatchRun]]
_Task = Callable[[RobustnessProblem, DrawnPlants, Mapping[str, Controller]], dict[str, Any]]


@dataclass(frozen=True)
class Item:
    """A `task` on controllers of one computing delay [s] and a block of the drawn plants."""

    delay: float
    block: range
    controllers: Sequence[ControllerSpec]
    task: _Task


def blocks(problem: RobustnessProblem) -> list[range]:
    """The drawn plants, `BLOCK` at a time."""
    return [range(first, min(first + BLOCK, problem.plants)) for first in range(0, problem.plants, BLOCK)]


def items(problem: RobustnessProblem, block: range) -> dict[str, Item]:
    """The work on a block of plants by the names of its stages: all controllers of a computing delay at every place,
    then the steps of each."""
    by_delay: dict[float, list[ControllerSpec]] = {}
    for spec in problem.controllers:
        by_delay.setdefault(problem.conditions.delay(spec, problem.rig), []).append(spec)
    listed = {}
    for delay, specs in by_delay.items():
        for place in places(problem):
            listed[linear_stage(place, delay, block)] = Item(delay, block, specs, partial(_linear, place=place))
        for spec in specs:
            if graph_law(spec.build(problem.rig.period.value)) is not None:
                listed[steps_stage(spec, delay, block)] = Item(delay, block, [spec], _steps)
    return listed


def linear_stage(place: Place, delay: float, block: range) -> str:
    """The name of a stage."""
    return f"linear {place} {_of(delay, block)}"


def steps_stage(spec: ControllerSpec, delay: float, block: range) -> str:
    """The name of a stage."""
    return f"{spec.name} {_of(delay, block)}"


def _of(delay: float, block: range) -> str:
    return f"{1e3 * delay:g} ms plants {block.start} to {block.stop - 1}"


def at_work(problem: RobustnessProblem) -> Callable[[Item], dict[str, Any]]:
    """The work of one process, which draws and balances a block of plants once for a computing delay."""
    plants = plants_by_block(problem)

    def work(item: Item) -> dict[str, Any]:
        controllers = {spec.name: spec.build(problem.rig.period.value) for spec in item.controllers}
        return item.task(problem, plants(item.delay, item.block), controllers)

    return work


def _linear(
    problem: RobustnessProblem, plants: DrawnPlants, controllers: Mapping[str, Controller], place: Place
) -> dict[str, Any]:
    return linear_loops(plants, controllers, place)


def _steps(problem: RobustnessProblem, plants: DrawnPlants, controllers: Mapping[str, Controller]) -> dict[str, Any]:
    """The steps of one controller."""
    (controller,) = controllers.values()
    return played_steps(problem, plants, partial(play_lanes, plants.engine, plants.rig, controller), controller)


def _held(
    problem: RobustnessProblem, plants: DrawnPlants, controller: Controller | None, remembered: list[np.ndarray]
) -> dict[str, np.ndarray]:
    """Plant by plant the worst linear loop of a law that stands with what it has in its memory at the end of its steps,
    over all places: Ms, NaN where it is unstable or there is no memory, and whether it is unstable."""
    count = len(plants.draw.position)
    if controller is None or not remembered:
        return {"held_ms": np.full(count, np.nan), "held_unstable": np.zeros(count, bool)}
    kept = np.concatenate(remembered)
    loops = (linear_loops(plants, {"": controller}, place, kept)[""] for place in places(problem))
    worst = worst_places([LaneMargins(**columns) for columns in loops])
    return {"held_ms": worst["ms"], "held_unstable": worst["unstable"]}


def played_steps(
    problem: RobustnessProblem,
    plants: DrawnPlants,
    play: Callable[..., LaneRuns],
    controller: Controller | None = None,
) -> dict[str, Any]:
    """The steps plant by plant, and the CPU seconds that they took; `play` runs lanes on plants at rest, of one
    `controller` for all where it may have a memory.

    Of several moves, there and back, the last one counts; a trip or a low pressure in any.
    """
    signal = problem.signal.name
    band = settling_band(plants.rig, signal, problem.step)
    period, k = problem.rig.period.value, round(problem.seconds / problem.rig.period.value) + 1
    levels = np.resize([problem.step, 0.0], problem.moves + 1)
    size = levels[-1] - (levels[-2] if problem.moves else 0.0)
    reference, began = np.repeat(levels, [k - 1] * problem.moves + [k]), process_time()
    at = plants.null, plants.draw.p
    run = partial(play, *at, reference, first=plants.block.start)
    parts, remembered, t = [], [], np.arange(k) * period
    chambers = ("lowest_pressure",) if plants.rig.is_jack else ()
    for _, lanes in run((signal, *chambers), problem.conditions.noise):
        y = lanes.signals[signal]
        last, before = y[:, -k:], y[:, 0] + levels[-1] - size
        target = before + size
        settling, overshoot = settling_times(t, last, target, band), overshoots(last, target, size)
        lowest = np.full(len(y), np.nan)
        for name in chambers:
            lowest = lanes.signals[name].min(axis=1)
        parts.append((settling, overshoot, lanes.trip, lanes.failed, lowest))
        remembered += [] if lanes.remembered is None else [lanes.remembered]
    took = process_time() - began
    settling, overshoot, trip, failed, lowest = (np.concatenate(part) for part in zip(*parts, strict=True))
    calm = (lanes.signals[signal] for _, lanes in run((signal,)))
    hunting = np.concatenate([hunting_lanes(period, y[:, -k:], size, HUNTING) for y in calm])
    return {
        "settling_s": settling,
        "overshoot_percent": overshoot,
        "hunting": hunting & (trip == 0) & ~failed,
        "tripped": (trip > 0) | failed,
        "lowest_pressure": lowest,
        "cpu_seconds": np.array([took]),
        **_held(problem, plants, controller, remembered),
    }
