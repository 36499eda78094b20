"""Robustness: one step by every controller on thousands of drawn plants, and the linear loops of all of them."""

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from ...base.kept_columns import KeptColumns
from ...base.process_pool import Jobs, process_pool
from ...base.words import counted
from ...loop.limit import limits_by_name
from ...loop.robustness.drawn_plants import drawn
from ...loop.robustness.row import Kept, kept_row
from ...loop.robustness.workers import at_work, blocks, items
from ...loop.scenarios import Scenario
from ...loop.sensors import settling_band
from ...plant import build
from ...report import Figure, Page
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .options import RobustnessConfig
from .page import robustness_figure, robustness_page

T = TypeVar("T")
_AT_ONCE = 8  # blocks whose results are in memory: so many that all workers are busy nearly all the time


def run_robustness(config: RobustnessConfig, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """`linear`: rows of every controller; `rows`: of those that run in lanes, `left_out` names the others.

    By blocks of plants, a stage a place of the linear loops and one a controller's steps, by the workers of `jobs`.
    """
    progress(f"{counted(len(config.controllers), 'controller')} on {counted(config.plants, 'plant')}")
    kept, draw = [Kept.of(spec, config) for spec in config.controllers], KeptColumns()
    plant, every = build(config.rig), blocks(config)
    with process_pool(jobs, partial(at_work, config)) as pool:
        for first in range(0, len(every), _AT_ONCE):
            some = every[first : first + _AT_ONCE]
            stages = {name: item for block in some for name, item in items(config, block).items()}
            results = dict(zip(stages, pool(stages, _told(stage, progress), lambda _: None), strict=True))
            for block in some:
                draw.append(drawn(config, plant, block).columns(config.rig))
                for each in kept:
                    each.take(results, block)
    step = Scenario("step", config.signal.name, config.step, config.seconds)
    limit = stage("limit", partial(limits_by_name, config.rig, [step]))[step.name]
    return _outcome(config, draw, kept, limit)


def _told(stage: Stage, progress: Progress) -> Stage:
    """A stage that reports its name when it is done."""

    def tell(name: str, compute: Callable[[], T]) -> T:
        result = stage(name, compute)
        progress(name)
        return result

    return tell


def _outcome(config: RobustnessConfig, draw: KeptColumns, kept: list[Kept], limit: float | None) -> Outcome:
    played = [each for each in kept if each.lanes]
    seconds = config.plants * config.seconds
    metrics = {
        "rows": [kept_row(each, config, limit) for each in played],
        "limit_s": limit,
        "linear": [row for each in kept for row in each.linear_rows()],
        "band": settling_band(config.rig, config.signal.name, config.step),
        "left_out": [each.spec.name for each in kept if not each.lanes],
        "timing": {
            "closed_loop_seconds_per_cpu_second": {each.spec.name: seconds / each.cpu_seconds for each in played}
        },
    }
    lanes = {each.spec.name: each.lanes for each in played}
    tables = {f"plants_{name}".replace("-", "_"): columns for name, columns in lanes.items()}
    subject = Subject(config.rig, config.controllers)

    def shown() -> tuple[Page, Figure]:
        return robustness_page(config, metrics, lanes, draw), robustness_figure(lanes)

    return Outcome(metrics, shown, {"drawn": draw, **tables}, {}, subject)
