"""What a found rig buys a controller: it is tuned there by the search of `jackbench tune`, and judged on both rigs."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ...base.process_pool import Jobs
from ...control.controller_spec import ControllerSpec
from ...loop.rig_variations import with_delay
from ...loop.rows import judge, linear_loops, loop_setup
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...loop.tuning.goals import Trial
from ...loop.tuning.search import nearest_trial, search
from ...report import Figure, Page
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..tune.options import TuneConfig
from ..tune.study import tuned_files
from .config import RetuneConfig
from .page import Pair, retune_page, steps_figure

_GAINS = ("settling_s", "overshoot_percent", "steady_state_error", "iae", "residual_oscillation", "ms")
_GAINS += ("gain_margin_db", "phase_margin_deg")


def run_retune(config: RetuneConfig, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """Search on the found rig with the workers of `jobs`; then the old and the retuned controller on both rigs.

    The first trial is the old controller. Each trial is a stage.
    """
    progress(f"{config.found.start.rig.name}: operating points")
    trials = search(config.found.problem, stage, progress, jobs)
    nearest = nearest_trial(trials)
    specs = {"old": config.declared.start.controllers[0], "retuned": config.found.problem.design(nearest.values)}
    runs: dict[Pair, dict[str, LoopRun]] = {}
    rows: list[dict[str, Any]] = []
    for what, spec in specs.items():
        for where, on in (("declared", config.declared), ("found", config.found)):
            progress(f"{what} on the {where} rig")
            runs[what, where], own = _judged(spec.named(what), where, on)
            rows += own
    scenario = gain_scenario(config.found.start.scenarios)
    metrics = {
        "controller": config.found.name,
        "rows": rows,
        "gain": _gain(rows, scenario),
        "scenario": scenario.name,
        "numbers": _numbers(config.found, trials[0], nearest),
        "missed": {"old": trials[0].verdict.missed, "retuned": nearest.verdict.missed},
        "goals": [asdict(goal) for goal in nearest.verdict.goals],
        "trials": len(trials),
    }
    files = tuned_files(config.found, nearest) if nearest.verdict.cost is not None else {}
    retuned = config.found.problem.design(nearest.values)
    subject = Subject(
        config.declared.start.rig, [config.found.start.controllers[0].named("old"), retuned.named("retuned")]
    )

    def draw() -> tuple[Page, Figure]:
        page = retune_page(config, trials, nearest, runs, metrics)
        return page, steps_figure(config.found, scenario, runs, rows)

    return Outcome(metrics, draw, _tables(runs), files, subject)


def gain_scenario(scenarios: tuple[Scenario, ...]) -> Scenario:
    """The one whose numbers say what was gained: the last step, or the first scenario where there is none."""
    steps = [scenario for scenario in scenarios if scenario.is_step and scenario.size]
    return steps[-1] if steps else scenarios[0]


def _judged(spec: ControllerSpec, where: str, on: TuneConfig) -> tuple[dict[str, LoopRun], list[dict[str, Any]]]:
    """Runs by scenario, and rows as a bench has them."""
    conditions = on.start.conditions
    setup = loop_setup(with_delay(replace(on.start.rig, name=where), conditions.delay(spec, on.start.rig)))
    loops = linear_loops(spec, setup)
    judged = {each.name: judge(spec, each, setup, loops, conditions.noise) for each in on.start.scenarios}
    return {name: run for name, (run, _) in judged.items()}, [row for _, row in judged.values()]


def _gain(rows: list[dict[str, Any]], scenario: Scenario) -> dict[str, list[float | None]]:
    """Before and after on the found rig."""
    before, after = (row for row in rows if (row["rig"], row["scenario"]) == ("found", scenario.name))
    return {key: [before[key], after[key]] for key in _GAINS}


def _numbers(config: TuneConfig, old: Trial, nearest: Trial) -> dict[str, dict[str, Any]]:
    return {
        number.name: {"old": old.values[number.name], "retuned": nearest.values[number.name], "unit": number.unit}
        for number in config.searched
    }


def _tables(runs: Mapping[Pair, Mapping[str, LoopRun]]) -> dict[str, dict[str, np.ndarray]]:
    return {
        f"step-{what}-{where}-{name}": {"t [s]": run.record.t, **run.record.signals}
        for (what, where), by_scenario in runs.items()
        for name, run in by_scenario.items()
    }
