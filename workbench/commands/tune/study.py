"""A search for the numbers of a controller: hard goals over a set of rigs first, then the least weighted cost."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from ...base.process_pool import Jobs
from ...base.toml_text import toml_text
from ...base.words import counted
from ...loop.rig_variations import with_delay
from ...loop.rows import LoopSetup, judge, linear_loops, loop_setup, play
from ...loop.sampled_loop import LoopRun
from ...loop.tuning.goals import Trial
from ...loop.tuning.problem import TuneProblem
from ...loop.tuning.search import nearest_trial, search
from ...report import Figure, Page
from ...rigs.rig_file import bundled as bundled_rigs, rig_text
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .options import TuneConfig
from .page import step_figure, tune_page


def run_tune(config: TuneConfig, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """Search with the workers of `jobs`, then show the best design beside the start. The first trial is the start.

    Each trial is a stage: a resumed search asks its sampler the same again and reads the stored answers, and so goes on
    as if nothing had happened.
    """
    progress(f"{counted(len(config.rigs), 'rig')}: operating points")
    trials = search(config.problem, stage, progress, jobs)
    nearest = nearest_trial(trials)
    best = nearest if nearest.verdict.cost is not None else None
    progress("the start and the best, on the nominal rig")
    nominal, *_ = config.rigs.values()
    setup = loop_setup(with_delay(nominal, config.start.conditions.delay(config.start.controllers[0], nominal)))
    designs = {"start": trials[0], "best": nearest}
    runs = {what: _runs(config, trial, setup) for what, trial in designs.items()}
    rows = tuned_rows(config.problem, nearest) if best else []
    metrics = {
        "best": None if best is None else _best(config, best, rows),
        "missed": nearest.verdict.missed,
        "trials": [_line(config, trial) for trial in trials],
    }
    loops = {what: linear_loops(config.problem.design(trial.values), setup) for what, trial in designs.items()}
    files = {} if best is None else tuned_files(config, best)
    tables = {
        f"step-{what}-{name}": {"t [s]": run.record.t, **run.record.signals}
        for what, by_scenario in runs.items()
        for name, run in by_scenario.items()
    }
    subject = Subject(config.start.rig, [config.problem.design(nearest.values)], config.rigs)

    def draw() -> tuple[Page, Figure]:
        page = tune_page(config, trials, nearest, runs, rows, loops)
        return page, step_figure(config, config.start.scenarios[0], runs, rows)

    return Outcome(metrics, draw, tables, files, subject)


def tuned_rows(problem: TuneProblem, trial: Trial) -> list[dict[str, Any]]:
    """A design on every rig of the set in every scenario: rows as `jackbench run` has them."""
    spec, rows = problem.design(trial.values), []
    for rig in problem.rigs.values():
        setup = loop_setup(with_delay(rig, problem.conditions.delay(spec, rig)))
        loops = linear_loops(spec, setup)
        rows += [judge(spec, scenario, setup, loops, problem.conditions.noise)[1] for scenario in problem.scenarios]
    return rows


def _runs(config: TuneConfig, trial: Trial, setup: LoopSetup) -> dict[str, LoopRun]:
    """A design on the nominal rig, by scenario."""
    controller = config.problem.design(trial.values)
    seed = config.start.conditions.noise
    return {scenario.name: play(controller, scenario, setup, seed) for scenario in config.start.scenarios}


def _numbers(config: TuneConfig, values: Mapping[str, float]) -> dict[str, dict[str, Any]]:
    return {number.name: {"value": values[number.name], "unit": number.unit} for number in config.searched}


def _best(config: TuneConfig, best: Trial, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The margins are the nominal rig's at mid stroke; `goals` say how far each is met, and where the worst lies."""
    margins = {key: rows[0][key] for key in ("ms", "gain_margin_db", "phase_margin_deg")}
    return {
        "controller": config.name,
        "trial": best.number,
        "cost": best.verdict.cost,
        "numbers": _numbers(config, best.values),
        **margins,
        "goals": [asdict(goal) for goal in best.verdict.goals],
        "worst_settling_s": _worst(rows, "settling_s"),
        "worst_overshoot_percent": _worst(rows, "overshoot_percent"),
        "rows": rows,
    }


def _worst(rows: list[dict[str, Any]], key: str) -> float | None:
    """Over rigs and scenarios; None where none has the number."""
    return max((line[key] for line in rows if line[key] is not None), default=None)


def _line(config: TuneConfig, trial: Trial) -> dict[str, Any]:
    verdict = trial.verdict
    result = {"cost": verdict.cost, "missed": verdict.missed, "miss": verdict.miss, "goals_left": verdict.left}
    return {"trial": trial.number, **result, "drawn": trial.drawn, "numbers": _numbers(config, trial.values)}


def tuned_files(config: TuneConfig, best: Trial) -> dict[str, str]:
    """tuned.toml, a step experiment of the best design, and beside it the rig where that is no bundled one."""
    bundled = config.rig_name in bundled_rigs()
    table = config.step_table(best.values, config.rig_name if bundled else "rig.toml")
    note = f"# {config.name} as tuned: trial {best.number + 1} of {config.designs} from seed {config.seed}.\n"
    files = {"tuned.toml": note + toml_text(table)}
    return files if bundled else {**files, "rig.toml": rig_text(config.start.rig)}
