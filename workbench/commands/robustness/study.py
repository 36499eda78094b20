"""Robustness: one step by every controller on thousands of drawn plants, and the linear loops of all of them."""

from functools import cached_property, partial
from time import process_time
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.linear_law import LinearLaw
from ...control.protocol import linear_law
from ...engine import Engine
from ...linear.equilibria import Equilibria, equilibria
from ...loop.batch import run_lanes
from ...loop.lane_margins import LaneMargins, SampledLanes, lane_margins, sampled_lanes
from ...loop.lane_metrics import hunting_lanes, step_lanes
from ...loop.rig_variations import with_delay
from ...loop.rows import MOVING
from ...loop.sensors import settling_band
from ...plant import build
from ...rigs.rig import Rig
from ..common.outcome import Outcome, Progress, Stage
from .config import RobustnessConfig
from .draw import PlantDraw, draw_plants
from .page import robustness_figure, robustness_page

HUNTING = 0.002  # of the step, peak to peak over the last 0.3 s: as a search has it
_LINEAR = 1000  # plants whose loops are linearised at a time


class _Setup:
    """The drawn plants of an experiment with their operating points at null and moving."""

    def __init__(self, config: RobustnessConfig, measures: tuple[str, ...]) -> None:
        self.config, self._measures = config, measures
        self.rig: Rig = with_delay(config.rig, config.computing_delay) if config.computing_delay else config.rig
        self.engine = Engine(build(self.rig))
        plant = self.engine.plant
        self.draw: PlantDraw = draw_plants(config, plant)
        self.null = equilibria(plant, self.draw.p, self.draw.position)
        self.moving = equilibria(plant, self.draw.p, self.draw.position, MOVING, specimen_velocity=MOVING)
        self.band = settling_band(self.rig, "position", config.step)

    @cached_property
    def linear(self) -> list[list[SampledLanes]]:
        """The plants linearised at null and moving, and sampled, some at a time: every controller needs them."""
        firsts = range(0, self.config.plants, _LINEAR)
        return [[self._linearised(points, first) for first in firsts] for points in (self.null, self.moving)]

    def _linearised(self, points: Equilibria, first: int) -> SampledLanes:
        lanes = slice(first, first + _LINEAR)
        some = Equilibria(points.x[lanes], points.u[lanes], points.ok[lanes])
        p, period = self.draw.p[lanes], self.rig.period.value
        return sampled_lanes(self.engine.plant, some, p, self._measures, period)


def run_robustness(config: RobustnessConfig, stage: Stage, progress: Progress) -> Outcome:
    """Rows of every controller that is a linear law; one without is named in `left_out`. A stage a controller."""
    progress(f"{config.plants} plants and their operating points")
    laws = {spec.name: linear_law(spec.build(config.rig.period.value)) for spec in config.controllers}
    measures = dict.fromkeys(name for law in laws.values() if law for name in law.measures)
    setup = _Setup(config, tuple(measures))
    rows, lanes, spent = [], {}, {}
    for spec in config.controllers:
        law = laws[spec.name]
        if law is None:
            continue
        progress(f"{spec.name} on {config.plants} plants")
        result = stage(spec.name, lambda spec=spec, law=law: _controller(setup, spec, law))
        rows.append(result["row"])
        lanes[spec.name], spent[spec.name] = result["lanes"], result["closed_loop_seconds_per_cpu_second"]
    left_out = [name for name, law in laws.items() if law is None]
    metrics: dict[str, Any] = {
        "rows": rows,
        "band": setup.band,
        "left_out": left_out,
        "timing": {"closed_loop_seconds_per_cpu_second": spent},
    }
    tables = {f"plants_{name}".replace("-", "_"): columns for name, columns in lanes.items()}
    drawn = {"position [m]": setup.draw.position} | {
        f"{name} [{config.rig.numbers[name].si}]": values for name, values in setup.draw.numbers.items()
    }
    page = robustness_page(config, metrics, lanes, setup.draw)
    return Outcome(metrics, page, robustness_figure(lanes), {"drawn": drawn, **tables})


def _controller(setup: _Setup, spec: ControllerSpec, law: LinearLaw) -> dict[str, Any]:
    """The steps and the linear loops of one controller, plant by plant, and its row."""
    config = setup.config
    period, k = config.rig.period.value, round(config.seconds / config.rig.period.value) + 1
    reference, began = np.full(k, config.step), process_time()
    run = partial(run_lanes, setup.engine, setup.rig, law, setup.null, setup.draw.p, reference)
    parts = []
    for _, lanes in run(("position", "lowest_pressure"), config.seed):
        y = lanes.signals["position"]
        step = step_lanes(period, y, y[:, 0], config.step, setup.band)
        lowest = lanes.signals["lowest_pressure"].min(axis=1)
        parts.append((step.settling, step.overshoot, lanes.trip, lanes.failed, lowest))
    rate = config.plants * config.seconds / (process_time() - began)
    settling, overshoot, trip, failed, lowest = (np.concatenate(part) for part in zip(*parts, strict=True))
    calm = (lanes.signals["position"] for _, lanes in run(("position",)))
    hunting = np.concatenate([hunting_lanes(period, y, config.step, HUNTING) for y in calm])
    null, moving = (_linear(parts, law) for parts in setup.linear)
    stable = null.stable & moving.stable & setup.null.ok & setup.moving.ok
    columns = {
        "settling_s": settling,
        "overshoot_percent": overshoot,
        "hunting": hunting & (trip == 0) & ~failed,
        "tripped": (trip > 0) | failed,
        "unstable": ~stable,
        "ms": np.where(stable, np.maximum(null.ms, moving.ms), np.nan),
        "gain_margin_db": np.where(stable, np.fmin(null.gain_margin_db, moving.gain_margin_db), np.nan),
        "lowest_pressure": lowest,
    }
    row = _row(spec.name, columns, setup)
    return {"row": row, "lanes": columns, "closed_loop_seconds_per_cpu_second": rate}


def _linear(parts: list[SampledLanes], law: LinearLaw) -> LaneMargins:
    margins = [lane_margins(part, law) for part in parts]
    columns = ([getattr(part, name) for part in margins] for name in ("radius", "ms", "gain_margin_db"))
    return LaneMargins(*(np.concatenate(column) for column in columns))


def _row(name: str, columns: dict[str, np.ndarray], setup: _Setup) -> dict[str, Any]:
    """The numbers of contract: quantiles count a plant that never settles as the slowest; None where that is one."""
    settling = np.where(np.isnan(columns["settling_s"]) | columns["tripped"], np.inf, columns["settling_s"])
    p50, p99, worst = (_finite(np.quantile(settling, q, method="higher")) for q in (0.5, 0.99, 1.0))
    bad = columns["unstable"] * 4.0 + columns["tripped"] * 2.0 + columns["hunting"] * 1.0
    lane = int(np.lexsort((np.nan_to_num(columns["ms"], nan=np.inf), settling, bad))[-1])
    drawn = {"x [m]": float(setup.draw.position[lane])}
    drawn |= {
        f"{number} [{setup.config.rig.numbers[number].si}]": float(values[lane])
        for number, values in setup.draw.numbers.items()
    }
    return {
        "controller": name,
        "plants": len(settling),
        **{key: int(columns[key].sum()) for key in ("unstable", "tripped", "hunting")},
        "settling_p50_s": p50,
        "settling_p99_s": p99,
        "settling_worst_s": worst,
        "overshoot_worst_percent": _finite(np.max(columns["overshoot_percent"])),
        "ms_worst": None if columns["unstable"].any() else _finite(np.max(columns["ms"])),
        "gain_margin_worst_db": None if columns["unstable"].any() else _finite(np.nanmin(columns["gain_margin_db"])),
        "cavitating": int((columns["lowest_pressure"] < 0).sum()),
        "worst": drawn,
    }


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
