"""What worker processes do: the linear loops of the controllers at a place, the steps of one controller."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from time import process_time
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.protocol import Controller
from ...loop.envelope import HUNTING
from ...loop.lane_loop import play_lanes, plays_in_lanes
from ...loop.lane_metrics import hunting_lanes, step_lanes
from ...loop.sensors import settling_band
from .config import RobustnessConfig
from .drawn_plants import DrawnPlants, drawn_plants
from .linear_loops import Place, linear_loops, places

_Task = Callable[[RobustnessConfig, DrawnPlants, Mapping[str, Controller]], dict[str, Any]]


@dataclass(frozen=True)
class Item:
    """A `task` on controllers of one computing delay [s]."""

    delay: float
    controllers: Sequence[ControllerSpec]
    task: _Task


def items(config: RobustnessConfig) -> dict[str, Item]:
    """By the names of their stages: all controllers of a computing delay at every place, then the steps of each."""
    by_delay: dict[float, list[ControllerSpec]] = {}
    for spec in config.controllers:
        by_delay.setdefault(config.conditions.delay(spec, config.rig), []).append(spec)
    listed = {}
    for delay, specs in by_delay.items():
        for place in places(config):
            listed[linear_stage(place, delay)] = Item(delay, specs, partial(_linear, place=place))
        for spec in specs:
            if plays_in_lanes(spec.build(config.rig.period.value)):
                listed[steps_stage(spec, delay)] = Item(delay, [spec], _steps)
    return listed


def linear_stage(place: Place, delay: float) -> str:
    """The name of a stage."""
    return f"linear {place} {1e3 * delay:g} ms"


def steps_stage(spec: ControllerSpec, delay: float) -> str:
    """The name of a stage."""
    return f"{spec.name} {1e3 * delay:g} ms"


def at_work(config: RobustnessConfig) -> Callable[[Item], dict[str, Any]]:
    """The work of one process, which draws and balances the plants once for a computing delay."""
    plants = cache(partial(drawn_plants, config))

    def work(item: Item) -> dict[str, Any]:
        controllers = {spec.name: spec.build(config.rig.period.value) for spec in item.controllers}
        return item.task(config, plants(item.delay), controllers)

    return work


def _linear(
    config: RobustnessConfig, plants: DrawnPlants, controllers: Mapping[str, Controller], place: Place
) -> dict[str, Any]:
    return linear_loops(plants, controllers, place)


def _steps(config: RobustnessConfig, plants: DrawnPlants, controllers: Mapping[str, Controller]) -> dict[str, Any]:
    """The steps of one controller, plant by plant, and how many closed-loop seconds a CPU second gave."""
    (controller,) = controllers.values()
    signal = config.signal.name
    band = settling_band(plants.rig, signal, config.step)
    period, k = config.rig.period.value, round(config.seconds / config.rig.period.value) + 1
    reference, began = np.full(k, config.step), process_time()
    run = partial(play_lanes, plants.engine, plants.rig, controller, plants.points["null"], plants.draw.p, reference)
    parts = []
    chambers = ("lowest_pressure",) if plants.rig.is_jack else ()
    for _, lanes in run((signal, *chambers), config.conditions.noise):
        y = lanes.signals[signal]
        step = step_lanes(period, y, y[:, 0], config.step, band)
        lowest = np.full(len(y), np.nan)
        for name in chambers:
            lowest = lanes.signals[name].min(axis=1)
        parts.append((step.settling, step.overshoot, lanes.trip, lanes.failed, lowest))
    rate = config.plants * config.seconds / (process_time() - began)
    settling, overshoot, trip, failed, lowest = (np.concatenate(part) for part in zip(*parts, strict=True))
    calm = (lanes.signals[signal] for _, lanes in run((signal,)))
    hunting = np.concatenate([hunting_lanes(period, y, config.step, HUNTING) for y in calm])
    return {
        "settling_s": settling,
        "overshoot_percent": overshoot,
        "hunting": hunting & (trip == 0) & ~failed,
        "tripped": (trip > 0) | failed,
        "lowest_pressure": lowest,
        "closed_loop_seconds_per_cpu_second": rate,
    }
