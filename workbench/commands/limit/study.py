"""The limit of every step and of every reference that moves of an experiment, a stage each."""

from collections.abc import Callable, Mapping
from typing import Any

from ...base.process_pool import Jobs, process_pool
from ...loop.limit import Limit, settling_limit
from ...loop.tracking_limit import TrackingLimit, tracking_limit
from ...report import Figure, Page
from ..common.bench_experiment import BenchConfig
from ..common.outcome import Outcome, Progress, Stage
from ..common.step_experiment import StepConfig
from .page import limit_page, limit_picture
from .steps import PlacedStep, placed_steps


def run_limit(
    config: BenchConfig | StepConfig, margin: float, stage: Stage, progress: Progress, jobs: Jobs = 1
) -> Outcome:
    """`rows`: the limit of each scenario at each place, no chamber less than `margin` [Pa] above vapour's pressure."""
    steps = {step.name: step for step in placed_steps(config)}
    with process_pool(jobs, _Work(margin)) as found:
        results = found(steps, stage, lambda result: progress(result["name"]))
    courses = {result["name"]: result["signals"] for result in results if result["signals"]}
    metrics = {"rows": [result["row"] for result in results], "margin_bar": margin / 1e5}

    def draw() -> tuple[Page, Figure]:
        return limit_page(config.rig, metrics, courses), limit_picture(courses)

    return Outcome(metrics, draw, {_table(name): columns for name, columns in courses.items()})


class _Work:
    """What a process does: a step's name, row and signals."""

    def __init__(self, margin: float) -> None:
        self.margin = margin

    def __call__(self) -> Callable[[PlacedStep], Mapping[str, Any]]:
        return self.limit

    def limit(self, step: PlacedStep) -> Mapping[str, Any]:
        if step.scenario.is_step:
            limit = settling_limit(step.rig, step.scenario, self.margin)
            own = _settling(step, limit)
        else:
            limit = tracking_limit(step.rig, step.scenario, self.margin)
            own = _tracking(limit)
        return {"name": step.name, "row": _row(step, limit) | own, "signals": dict(limit.signals)}


def _row(step: PlacedStep, limit: Limit | TrackingLimit) -> dict[str, Any]:
    """SI but for what keys say; None, and the reason, where no motion was found."""
    return {
        "scenario": step.scenario.name,
        "rig": step.of,
        "signal": step.scenario.signal,
        "moves": not step.scenario.is_step,
        "x_m": step.position,
        "stiffness_n_per_m": step.rig.specimen_stiffness,
        "lowest_pressure_bar": None if limit.lowest_pressure is None else limit.lowest_pressure / 1e5,
        "peak_command": limit.peak_command,
        "reason": limit.reason,
        **dict.fromkeys(_OWN),
    }


_OWN = (
    *("limit_s", "mesh_difference_s", "overshoot_percent", "played_off_percent", "band"),  # of a step
    *("limit_error", "mesh_difference_error", "largest_error"),  # of a reference that moves
)


def _settling(step: PlacedStep, limit: Limit) -> dict[str, Any]:
    return {
        "limit_s": limit.settling,
        "mesh_difference_s": limit.mesh_difference,
        "overshoot_percent": limit.overshoot,
        "played_off_percent": None if limit.off is None else 100 * limit.off / abs(step.scenario.size),
        "band": limit.band,
    }


def _tracking(limit: TrackingLimit) -> dict[str, Any]:
    return {
        "limit_error": limit.error,
        "mesh_difference_error": limit.mesh_difference,
        "largest_error": limit.largest,
    }


def _table(name: str) -> str:
    return "".join(letter if letter.isalnum() else "_" for letter in name)
