"""The automatic tuning run on a set of rigs and on drawn plants: each tunes itself at mid stroke, then it is judged."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...base.kept_columns import KeptColumns
from ...control.automatic_tuning import READ, small_moves, tuned
from ...control.controller_spec import ControllerSpec
from ...control.law import static_law
from ...control.protocol import graph_law
from ...engine import Engine
from ...linear.equilibria import equilibria
from ...linear.operating_point import far_end
from ...loop.automatic import tuned_on
from ...loop.batch import run_lanes
from ...loop.limit import limits_by_name
from ...loop.rig_variations import with_delay
from ...loop.robustness.drawn_plants import DrawnPlants, drawn_plants
from ...loop.robustness.linear_loops import linear_loops as loops_at, places
from ...loop.robustness.row import Kept, kept_row
from ...loop.robustness.workers import blocks, linear_stage, played_steps, steps_stage
from ...loop.rows import judge, linear_loops, loop_setup
from ...loop.scenarios import Scenario
from ...loop.sensors import logged_lanes, settling_band
from ...plant import build
from ...report import Figure, Page, Section
from ..common.design_numbers import Subject
from ..common.judged import judged_words
from ..common.metric_table import MetricView
from ..common.outcome import Outcome, Progress, Stage
from ..robustness.page import robustness_figure, robustness_page
from .automatic_config import AutomaticConfig

_KEYS = (
    "scenario", "rig", "gain", "pressure_gain", "settling_s", "overshoot_percent", "residual_oscillation", "stable",
    "ms", "gain_margin_db", "tripped",
)  # fmt: skip


def run_automatic(config: AutomaticConfig, stage: Stage, progress: Progress) -> Outcome:
    """`rows` of every rig in every scenario, with its gains; `drawn`: a row of all plants, as robustness has it, with
    how many `never` settle and how many have `no_swing`, and so no pressure feedback; `linear`, their loops."""
    rows, specs = [], []
    for name, rig in config.rigs.items():
        progress(f"{name}: moves, gains, steps")
        setup = loop_setup(with_delay(rig, config.delay))
        spec = tuned_on(config.moving, setup, config.drawn.conditions.noise)
        loops = linear_loops(spec, setup)
        for scenario in config.scenarios:
            _, row = judge(spec, scenario, setup, loops, config.drawn.conditions.noise)
            rows.append({**row, "rig": name, **_gains(spec)})
        specs.append(spec.named(name))
    kept, draw, gains = _drawn(config, stage, progress)
    step = Scenario("step", "position", config.drawn.step, config.drawn.seconds)
    limit = stage("limit", partial(limits_by_name, config.rig, [step]))[step.name]
    metrics = {
        "rows": rows,
        "drawn": [{**kept_row(kept, config.drawn, limit), **_counts(kept, gains)}],
        "linear": kept.linear_rows(),
        "band": settling_band(config.rig, "position", config.drawn.step),
        "left_out": [],
    }
    lanes = {kept.spec.name: kept.lanes}

    def shown() -> tuple[Page, Figure]:
        return automatic_page(config, metrics, lanes, draw), robustness_figure(lanes)

    tables = {"drawn": draw, "plants": {**kept.lanes, **gains}}
    return Outcome(metrics, shown, tables, {}, Subject(config.rig, specs))


def tuned_lanes(config: AutomaticConfig, plants: DrawnPlants) -> list[ControllerSpec]:
    """Controllers tuned on drawn plants [plants] at mid stroke: the moves in lanes, the rules one by one."""
    plant, p, numbers = plants.engine.plant, plants.draw.p, config.moving.design
    seed, first, middle = config.drawn.conditions.noise, plants.block.start, np.zeros(len(plants.draw.p))
    at = equilibria(plant, p, middle, None, None, **far_end(plant, middle))
    slow = static_law([numbers.hold, -numbers.hold], ("position",), plants.rig.period.value)
    run = partial(run_lanes, plants.engine, plants.rig, slow, at, p, np.zeros(len(config.pulses)), READ)
    specs = []
    for lanes, done in run(seed, None, first, config.pulses):
        log = partial(logged_lanes, rig=plants.rig, outputs=plant.outputs, seed=seed, first=first + lanes.start)
        position, pa, pb = (log(done.signals[name], name) for name in READ)
        for sent, x, load in zip(done.sent - at.u[lanes, :1], position, pa - pb, strict=True):
            moves = small_moves(sent, x, load, plants.rig.period.value)
            specs.append(tuned(moves, numbers.column, numbers.middle))
    return specs


def _drawn(
    config: AutomaticConfig, stage: Stage, progress: Progress
) -> tuple[Kept, KeptColumns, Mapping[str, np.ndarray]]:
    """What is kept of the drawn plants, a stage a block, what was drawn, and the gains [plants]."""
    kept, draw, gains = Kept.of(config.moving, config.drawn), KeptColumns(), KeptColumns()
    rig = with_delay(config.rig, config.delay)
    engine = Engine(build(rig))
    for block in blocks(config.drawn):
        name = f"plants {block.start} to {block.stop - 1}"
        progress(f"{name}: moves, gains, steps, loops")
        plants = drawn_plants(config.drawn, rig, engine, block)
        done = stage(name, partial(_judged, config, plants))
        kept.take(done["results"], block)
        gains.append(done["gains"])
        draw.append(plants.draw.columns(config.rig))
    return kept, draw, gains


def _judged(config: AutomaticConfig, plants: DrawnPlants) -> dict[str, Any]:
    """The gains of a block of plants, and its results as `Kept` takes them."""
    specs, block, moving = tuned_lanes(config, plants), plants.block, config.moving
    controllers = [spec.build(plants.rig.period.value) for spec in specs]
    laws = [law for each in controllers if (law := graph_law(each)) is not None]
    play = partial(run_lanes, plants.engine, plants.rig, laws)
    results: dict[str, Any] = {
        steps_stage(moving, config.delay, block): played_steps(config.drawn, plants, play),
        **{
            linear_stage(place, config.delay, block): loops_at(plants, {moving.name: controllers}, place)
            for place in places(config.drawn)
        },
    }
    each = [_gains(spec) for spec in specs]
    return {"gains": {name: np.array([own[name] for own in each]) for name in each[0]}, "results": results}


def _gains(spec: ControllerSpec) -> dict[str, float]:
    """The gains of a tuned controller, SI."""
    (feedback,) = spec.compensators
    return {"gain": spec.design.gain, "pressure_gain": feedback.design.gain}


def _counts(kept: Kept, gains: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Plants that never settle, and those without pressure feedback."""
    lanes = kept.lanes
    return {
        "never": int((np.isnan(lanes["settling_s"]) | lanes["tripped"]).sum()),
        "no_swing": int((gains["pressure_gain"] == 0).sum()),
    }


def automatic_page(
    config: AutomaticConfig,
    metrics: Mapping[str, Any],
    lanes: Mapping[str, Mapping[str, np.ndarray]],
    draw: Mapping[str, np.ndarray],
) -> Page:
    """Every rig with its own gains, then the plants."""
    maker = MetricView.of(config.rig, config.drawn.signal, config.scenarios)
    note = (
        "Gains by rules, from small moves of each rig: of P [1/m] and of the pressure feedback [1/Pa]. "
        f"{judged_words(config.drawn.conditions, config.rig)}"
    )
    first = Section("The rig set", [maker.table("Each tuned by itself", metrics["rows"], _KEYS, note)])
    page = robustness_page(config.drawn, {**metrics, "rows": metrics["drawn"]}, lanes, draw)
    return replace(page, title=f"Automatic tuning of {config.rig.name}", sections=[first, *page.sections])
