"""Robustness of a platform: steps by every controller on drawn payloads, poses and legs, and their linear loops."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from time import process_time
from typing import Any

import numpy as np

from ...base.numbers import finite, quantile
from ...base.process_pool import Jobs, process_pool
from ...base.words import counted
from ...loop.platform.robustness import drawn_platform, linear_columns, step_columns
from ...loop.platform.setup import platform_setup
from ...loop.robustness.row import settling_quantiles
from ...rigs.oil import CAVITATES
from ..common.outcome import Outcome, Progress, Stage
from .options import PlatformRobustness, RobustnessConfig
from .platform_page import platform_page
from .study import run_robustness

BLOCK = 50  # platforms at a time: a step of one is 0.7 MB
Columns = dict[str, np.ndarray]  # by name, [plants]


def run_any(config: RobustnessConfig | PlatformRobustness, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """The study of a jack or of a platform."""
    if isinstance(config, PlatformRobustness):
        return run_platform_robustness(config, stage, progress, jobs)
    return run_robustness(config, stage, progress, jobs)


def run_platform_robustness(config: PlatformRobustness, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """`rows`, one a controller and step; `linear`, one a controller. By blocks of platforms, a stage each."""
    progress(f"{counted(len(config.controllers), 'controller')} on {counted(config.plants, 'platform')}")
    blocks = [range(first, min(first + BLOCK, config.plants)) for first in range(0, config.plants, BLOCK)]
    items = {f"platforms {block.start} to {block.stop - 1}": block for block in blocks}
    with process_pool(jobs, partial(_at_work, config)) as pool:
        done = pool(items, stage, lambda entry: progress(f"{entry['last']} of {config.plants}"))
    columns = {key: np.concatenate([entry["columns"][key] for entry in done]) for key in done[0]["columns"]}
    spent = {spec.name: sum(entry["cpu_s"][spec.name] for entry in done) for spec in config.controllers}
    seconds = config.plants * sum(step.duration for step in config.steps)
    metrics = {
        "rows": [_row(config, columns, spec.name, step.name) for spec in config.controllers for step in config.steps],
        "linear": [_linear(columns, spec.name, config) for spec in config.controllers],
        "timing": {"closed_loop_seconds_per_cpu_second": {name: seconds / took for name, took in spent.items()}},
    }
    drawn = {name.removeprefix("drawn."): values for name, values in columns.items() if name.startswith("drawn.")}
    judged = {name.replace(".", "_"): values for name, values in columns.items() if not name.startswith("drawn.")}
    return Outcome(metrics, lambda: platform_page(config, metrics, columns, drawn), {"plants": {**drawn, **judged}})


def _at_work(config: PlatformRobustness) -> Callable[[range], dict[str, Any]]:
    """The work of one process, which builds the platform once: a block of the drawn ones."""
    setup = platform_setup(config.rig, config.delay, brief=config.plants <= BLOCK)
    controllers = {spec.name: spec.build(setup.platform.period, setup.directions) for spec in config.controllers}

    def work(block: range) -> dict[str, Any]:
        platforms = [drawn_platform(setup, config.draw, config.conditions.seed, number) for number in block]
        columns: Columns = {
            f"drawn.{name}": np.array([each.numbers[name] for each in platforms]) for name in platforms[0].numbers
        }
        spent = dict.fromkeys(controllers, 0.0)
        for name, controller in controllers.items():
            columns |= _named(f"{name}.linear", asdict(linear_columns(platforms, controller)))
            began = process_time()
            for step in config.steps:
                played = step_columns(setup, platforms, controller, step, config.conditions.noise)
                columns |= _named(f"{name}.{step.name}", asdict(played))
            spent[name] = process_time() - began
        return {"last": block.stop, "columns": columns, "cpu_s": spent}

    return work


def _named(first: str, columns: Mapping[str, np.ndarray]) -> Columns:
    return {f"{first}.{name}": values for name, values in columns.items()}


def _linear(columns: Columns, name: str, config: PlatformRobustness) -> dict[str, Any]:
    """`failing`: on how many platforms the loop is unstable, or anything is wrong in a step."""
    failing = [_failing(columns, name, step.name) for step in config.steps]
    stable, ms, coupling = (columns[f"{name}.linear.{key}"] for key in ("stable", "ms", "coupling"))
    whole = bool(stable.all())
    return {
        "controller": name,
        "unstable": int((~stable).sum()),
        "failing": int(np.any([~stable, *failing], axis=0).sum()),
        **_masses("unstable", columns, ~stable),
        "ms_median": quantile(np.nan_to_num(ms, nan=np.inf), 0.5),
        "ms_worst": float(ms.max()) if whole else None,
        "coupling_median_percent": quantile(np.nan_to_num(coupling, nan=np.inf), 0.5),
        "coupling_worst_percent": float(coupling.max()) if whole else None,
    }


def _masses(what: str, columns: Columns, those: np.ndarray) -> dict[str, float | None]:
    """The lightest and the heaviest payload [kg] of `those` platforms, None where there are none."""
    mass = columns["drawn.mass"][those.astype(bool)]
    ends = (float(mass.min()), float(mass.max())) if len(mass) else (None, None)
    return dict(zip((f"{what}_least_kg", f"{what}_most_kg"), ends, strict=True))


def _failing(columns: Columns, name: str, step: str) -> np.ndarray:
    """Whether a platform trips, hunts or never settles in a step [plants]."""
    tripped, hunting, settling = (columns[f"{name}.{step}.{key}"] for key in ("tripped", "hunting", "settling"))
    return tripped | hunting | ~np.isfinite(settling)


def _row(config: PlatformRobustness, columns: Columns, name: str, step: str) -> dict[str, Any]:
    """Quantiles count a platform that never settles as the slowest; None where that is one."""
    keys = ("settling", "overshoot", "cross", "tripped", "hunting", "lowest")
    own = {key: columns[f"{name}.{step}.{key}"] for key in keys}
    settling = np.nan_to_num(own["settling"], nan=np.inf)
    lane, failing = int(np.argmax(settling)), _failing(columns, name, step)
    return {
        "controller": name,
        "scenario": step,
        "plants": config.plants,
        "tripped": int(own["tripped"].sum()),
        "hunting": int(own["hunting"].sum()),
        "never": int(np.isinf(settling).sum()),
        **_masses("failing", columns, failing),
        **settling_quantiles(settling),
        "overshoot_worst_percent": finite(own["overshoot"].max()),
        "cross_worst_percent": finite(own["cross"].max()),
        "cavitating": int((own["lowest"] < CAVITATES).sum()),
        "worst": {key.removeprefix("drawn."): float(columns[key][lane]) for key in columns if key.startswith("drawn.")},
    }
