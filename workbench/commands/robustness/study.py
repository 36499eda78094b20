"""Robustness: one step by every controller on thousands of drawn plants, and the linear loops of all of them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np

from ...base.process_pool import Jobs, process_pool
from ...loop.lane_margins import LaneMargins
from ...loop.sensors import settling_band
from ...plant import build
from ...report import Figure, Page
from ..common.design_numbers import Subject
from ..common.numbers import finite, quantile
from ..common.outcome import Outcome, Progress, Stage
from ..common.plant_draw import PlantDraw
from .config import RobustnessConfig
from .draw import drawn
from .linear_loops import Place, PlaceMargins, linear_rows, places, worst_places
from .page import robustness_figure, robustness_page
from .workers import at_work, items, linear_stage, steps_stage

T = TypeVar("T")


@dataclass(frozen=True)
class _Judged:
    """A controller's row, its columns plant by plant, and its closed-loop seconds per CPU second."""

    row: dict[str, Any]
    lanes: dict[str, np.ndarray]
    rate: float


def run_robustness(config: RobustnessConfig, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """`linear`: rows of every controller; `rows`: of those that run in lanes, `left_out` names the others.

    A stage a place of the linear loops, and one a controller's steps, by the workers of `jobs`.
    """
    progress(f"{len(config.controllers)} controllers on {config.plants} plants")
    stages = items(config)
    with process_pool(jobs, partial(at_work, config)) as pool:
        columns = dict(zip(stages, pool(stages, _told(stage, progress), lambda _: None), strict=True))
    draw = drawn(config, build(config.rig))
    loops, judged = {}, {}
    for spec in config.controllers:
        delay = config.conditions.delay(spec, config.rig)
        at = {place: columns[linear_stage(place, delay)][spec.name] for place in places(config)}
        loops[spec.name] = [PlaceMargins(place, LaneMargins(**margins)) for place, margins in at.items()]
        steps = columns.get(steps_stage(spec, delay))
        if steps is not None:
            judged[spec.name] = _judged(spec.name, steps, config, draw, loops[spec.name])
    metrics = {
        "rows": [part.row for part in judged.values()],
        "linear": [row for name, at in loops.items() for row in linear_rows(name, at)],
        "band": settling_band(config.rig, config.signal.name, config.step),
        "left_out": [name for name in loops if name not in judged],
        "timing": {"closed_loop_seconds_per_cpu_second": {name: part.rate for name, part in judged.items()}},
    }
    return _outcome(config, draw, metrics, {name: part.lanes for name, part in judged.items()})


def _told(stage: Stage, progress: Progress) -> Stage:
    """A stage that reports its name when it is done."""

    def tell(name: str, compute: Callable[[], T]) -> T:
        result = stage(name, compute)
        progress(name)
        return result

    return tell


def _outcome(
    config: RobustnessConfig, draw: PlantDraw, metrics: dict[str, Any], lanes: dict[str, dict[str, np.ndarray]]
) -> Outcome:
    tables = {f"plants_{name}".replace("-", "_"): columns for name, columns in lanes.items()}
    subject = Subject(config.rig, config.controllers)

    def shown() -> tuple[Page, Figure]:
        return robustness_page(config, metrics, lanes, draw), robustness_figure(lanes)

    return Outcome(metrics, shown, {"drawn": draw.columns(config.rig), **tables}, {}, subject)


def _judged(
    name: str, steps: dict[str, Any], config: RobustnessConfig, draw: PlantDraw, places: list[PlaceMargins]
) -> _Judged:
    columns = {key: steps[key] for key in ("settling_s", "overshoot_percent", "hunting", "tripped", "lowest_pressure")}
    worst = worst_places(places)
    row = _row(name, columns | worst, config, draw, places)
    lanes = columns | {key: worst[key] for key in ("unstable", "ms", "gain_margin_db")}
    return _Judged(row, lanes, steps["closed_loop_seconds_per_cpu_second"])


def _row(
    name: str,
    columns: dict[str, np.ndarray],
    config: RobustnessConfig,
    draw: PlantDraw,
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
        "worst": _drawn(
            lane, config, draw, places[columns["furthest"][lane]].place if columns["unstable"][lane] else None
        ),
    }


def _drawn(lane: int, config: RobustnessConfig, draw: PlantDraw, place: Place | None) -> dict[str, float]:
    """The numbers of a plant, and its position: at `place`, else where it was drawn."""
    numbers = draw.plant(lane, config.rig)
    if place is not None and place.position is not None:
        numbers["x [m]"] = place.position
    return numbers
