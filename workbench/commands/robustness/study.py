"""Robustness: one step by every controller on thousands of drawn plants, and the linear loops of all of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from time import process_time
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.protocol import Controller
from ...loop.lane_loop import play_lanes, plays_in_lanes
from ...loop.lane_metrics import hunting_lanes, step_lanes
from ...loop.sensors import settling_band
from ...plant import build
from ..common.design_numbers import Subject
from ..common.numbers import finite, quantile
from ..common.outcome import Outcome, Progress, Stage
from ..common.plant_draw import PlantDraw
from .config import RobustnessConfig
from .draw import drawn
from .drawn_plants import DrawnPlants, drawn_plants
from .linear_loops import PlaceMargins, linear_loops, linear_rows, worst_places
from .page import robustness_figure, robustness_page

HUNTING = 0.002  # of the step, peak to peak over the last 0.3 s: as a search has it


@dataclass(frozen=True)
class _Judged:
    """A controller's row, its columns plant by plant, and its closed-loop seconds per CPU second."""

    row: dict[str, Any]
    lanes: dict[str, np.ndarray]
    rate: float


def run_robustness(config: RobustnessConfig, stage: Stage, progress: Progress) -> Outcome:
    """`linear`: rows of every controller; `rows`: of those that run in lanes, `left_out` names the others.

    A stage a place of the linear loops, and one a controller's steps.
    """
    delays = {spec.name: config.conditions.delay(spec, config.rig) for spec in config.controllers}
    places, judged = {}, {}
    for delay in dict.fromkeys(delays.values()):
        late = [spec for spec in config.controllers if delays[spec.name] == delay]
        progress(f"{config.plants} plants and their operating points, {1e3 * delay:g} ms of computing delay")
        _judge(late, config, drawn_plants(config, delay), partial(_stage_of, stage, delay), progress, places, judged)
    rows = {name: judged[name] for name in delays if name in judged}
    metrics = {
        "rows": [part.row for part in rows.values()],
        "linear": [row for name in delays for row in linear_rows(name, places[name])],
        "band": settling_band(config.rig, config.signal.name, config.step),
        "left_out": [name for name in delays if name not in judged],
        "timing": {"closed_loop_seconds_per_cpu_second": {name: part.rate for name, part in rows.items()}},
    }
    draw = drawn(config, build(config.rig))
    return _outcome(config, draw, metrics, {name: part.lanes for name, part in rows.items()})


def _stage_of(stage: Stage, delay: float, name: str, compute: Callable[[], Any]) -> Any:
    """A stage whose name says the computing delay."""
    return stage(f"{name} {1e3 * delay:g} ms", compute)


def _judge(
    specs: Sequence[ControllerSpec],
    config: RobustnessConfig,
    plants: DrawnPlants,
    stage: Stage,
    progress: Progress,
    places: dict[str, list[PlaceMargins]],
    judged: dict[str, _Judged],
) -> None:
    """Write what controllers of one computing delay do into `places` and `judged`, by name."""
    controllers = {spec.name: spec.build(config.rig.period.value) for spec in specs}
    places |= linear_loops(plants, controllers, stage, progress)
    for name, controller in controllers.items():
        if plays_in_lanes(controller):
            progress(f"{name} on {config.plants} plants")
            steps = stage(name, lambda controller=controller: _steps(config, plants, controller))
            judged[name] = _judged(name, steps, config, plants, places[name])


def _outcome(
    config: RobustnessConfig, draw: PlantDraw, metrics: dict[str, Any], lanes: dict[str, dict[str, np.ndarray]]
) -> Outcome:
    tables = {f"plants_{name}".replace("-", "_"): columns for name, columns in lanes.items()}
    page = robustness_page(config, metrics, lanes, draw)
    subject = Subject(config.rig, config.controllers)
    return Outcome(metrics, page, robustness_figure(lanes), {"drawn": draw.columns(config.rig), **tables}, {}, subject)


def _judged(
    name: str, steps: dict[str, Any], config: RobustnessConfig, plants: DrawnPlants, places: list[PlaceMargins]
) -> _Judged:
    columns = {key: steps[key] for key in ("settling_s", "overshoot_percent", "hunting", "tripped", "lowest_pressure")}
    worst = worst_places(places)
    row = _row(name, columns | worst, config, plants, places)
    lanes = columns | {key: worst[key] for key in ("unstable", "ms", "gain_margin_db")}
    return _Judged(row, lanes, steps["closed_loop_seconds_per_cpu_second"])


def _steps(config: RobustnessConfig, plants: DrawnPlants, controller: Controller) -> dict[str, Any]:
    """The steps of one controller, plant by plant, and how many closed-loop seconds a CPU second gave."""
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


def _row(
    name: str,
    columns: dict[str, np.ndarray],
    config: RobustnessConfig,
    plants: DrawnPlants,
    places: list[PlaceMargins],
) -> dict[str, Any]:
    """One row: quantiles count a plant that never settles as the slowest; None where that is one."""
    settling = np.where(np.isnan(columns["settling_s"]) | columns["tripped"], np.inf, columns["settling_s"])
    p50, p99, worst = (quantile(settling, share) for share in (0.5, 0.99, 1.0))
    bad = columns["unstable"] * 4.0 + columns["tripped"] * 2.0 + columns["hunting"] * 1.0
    lane = int(np.lexsort((np.nan_to_num(columns["ms"], nan=np.inf), settling, bad))[-1])
    unstable = bool(columns["unstable"].any())
    return {
        "controller": name,
        "plants": len(settling),
        **{key: int(columns[key].sum()) for key in ("unstable", "tripped", "hunting")},
        "settling_p50_s": p50,
        "settling_p99_s": p99,
        "settling_worst_s": worst,
        "overshoot_worst_percent": finite(np.max(columns["overshoot_percent"])),
        "ms_worst": None if unstable else finite(np.max(columns["ms"])),
        "gain_margin_worst_db": None if unstable else finite(np.fmin.reduce(columns["gain_margin_db"])),
        "cavitating": int((columns["lowest_pressure"] < 0).sum()),
        "worst": _drawn(lane, config, plants, places[columns["furthest"][lane]] if columns["unstable"][lane] else None),
    }


def _drawn(lane: int, config: RobustnessConfig, plants: DrawnPlants, place: PlaceMargins | None) -> dict[str, float]:
    """The numbers of a plant, and its position: at `place`, else where it was drawn."""
    numbers = plants.draw.plant(lane, config.rig)
    if place is not None and place.position is not None:
        numbers["x [m]"] = place.position
    return numbers
