"""A policy searched from several seeds, and whether it beats the law that it stands on."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from ...base.checkpoint import Progress, Stage
from ...base.process_pool import Jobs
from ...base.toml_text import toml_text
from ...loop.envelope import DRAWN
from ...loop.rig_variations import with_delay
from ...loop.rows import loop_setup, play
from ...loop.sampled_loop import LoopRun
from ...loop.tuning.goals import Trial, Verdict
from ...report import Figure, Page
from ...rigs.rig_file import bundled, rig_text
from ..common.design_numbers import Subject
from ..common.outcome import Outcome
from ..tune.page import step_figure
from ..tune.study import tuned_rows
from .options import POLICY_FILE, TrainConfig
from .page import train_page
from .policies import TrainingRun, run_searches
from .unseen import unseen_rows


def run_train(config: TrainConfig, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """Every run, and the best of them beside the start: the law with a network that adds nothing, or with the given."""
    runs, start = run_searches(config.problem, config.seeds, stage, progress, jobs)
    best = min(runs, key=lambda run: run.verdict.score)
    progress("the start and the best, on the rigs of the set")
    first = runs[0].trials[0]
    rows = {"start": tuned_rows(config.problem, first), "trained": tuned_rows(config.problem, best.nearest)}
    progress("and on plants that no run has seen")
    unseen = unseen_rows(config.problem, {"start": first.values, "trained": best.nearest.values}, stage)
    trained = best.verdict.cost is not None
    metrics = {
        "best": _best(config, best, start, rows) if trained else None,
        "start": _judged(start),
        "evaluations": sum(len(run.trials) for run in runs),
        "drawn": DRAWN if config.factors else 0,
        "unseen": unseen,
        "runs": [_line(run) for run in runs],
    }
    steps = _steps(config, {"start": first, "trained": best.nearest})
    files = _files(config, best) if trained else {}
    tables = {
        f"step-{what}-{name}": {"t [s]": run.record.t, **run.record.signals}
        for what, by_scenario in steps.items()
        for name, run in by_scenario.items()
    }
    subject = Subject(config.start.rig, [config.problem.design(best.nearest.values)], config.rigs)

    def draw() -> tuple[Page, Figure]:
        page = train_page(config, runs, best, start, rows, unseen, steps)
        return page, step_figure(config, config.start.scenarios[0], steps, rows["trained"])

    return Outcome(metrics, draw, tables, files, subject)


def _best(config: TrainConfig, best: TrainingRun, start: Verdict, rows: Mapping[str, Sequence[Any]]) -> dict[str, Any]:
    return {
        "controller": config.name,
        "seed": best.seed,
        "evaluation": best.nearest.number,
        **_judged(best.verdict),
        "cost_of_start": start.cost,
        "numbers": {
            number.name: {"value": best.nearest.values[number.name], "unit": number.unit}
            for number in config.searched
            if not number.is_weight
        },
        "weights": config.trained(best.nearest.values).numbers.tolist(),
        "rows": rows["trained"],
        "rows_of_start": rows["start"],
    }


def _judged(verdict: Verdict) -> dict[str, Any]:
    """On all drawn plants."""
    return {"cost": verdict.cost, "missed": verdict.missed, "goals": [asdict(goal) for goal in verdict.goals]}


def _line(run: TrainingRun) -> dict[str, Any]:
    verdict = {"cost": run.verdict.cost, "missed": run.verdict.missed}
    return {"seed": run.seed, "evaluations": len(run.trials), **verdict, "curve": run.curve}


def _files(config: TrainConfig, best: TrainingRun) -> dict[str, str | bytes]:
    """trained.toml, the weights beside it, and the rig where that is no bundled one."""
    is_bundled = config.rig_name in bundled()
    table = config.step_table(best.nearest.values, config.rig_name if is_bundled else "rig.toml")
    place = f"evaluation {best.nearest.number + 1} of {config.designs} from seed {best.seed}"
    policy = config.trained(best.nearest.values).packed()
    files: dict[str, str | bytes] = {
        POLICY_FILE: policy,
        "trained.toml": f"# {config.name} as trained: {place}.\n" + toml_text(table),
    }
    return files if is_bundled else {**files, "rig.toml": rig_text(config.start.rig)}


def _steps(config: TrainConfig, trials: Mapping[str, Trial]) -> dict[str, dict[str, LoopRun]]:
    """Designs on the nominal rig, by scenario."""
    nominal, *_ = config.rigs.values()
    setup = loop_setup(with_delay(nominal, config.start.conditions.delay(config.start.controllers[0], nominal)))
    seed, scenarios = config.start.conditions.noise, config.start.scenarios
    laws = {what: config.problem.design(trial.values) for what, trial in trials.items()}
    return {what: {s.name: play(law, s, setup, seed) for s in scenarios} for what, law in laws.items()}
