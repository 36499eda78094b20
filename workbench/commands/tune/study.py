"""A search for the numbers of a controller: hard goals over a set of rigs first, then the least weighted cost."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

import tomli_w

from ...base.process_pool import process_pool
from ...loop.rig_variations import variation
from ...loop.rows import LoopSetup, loop_setup, play
from ...loop.sampled_loop import LoopRun
from ...rigs.rig import bundled as bundled_rigs
from ...rigs.rig import rig_text
from ..common.outcome import Outcome, Progress, Stage
from .config import TuneConfig
from .goals import Goals, Trial, Verdict
from .page import step_figure, tune_page

TOGETHER = 4  # designs that are tried before any of them is learnt from


def run_tune(config: TuneConfig, stage: Stage, progress: Progress, jobs: int = 1) -> Outcome:
    """Search with `jobs` processes, then show the best design beside the start. The first trial is the start.

    Each trial is a stage: a resumed search asks its sampler the same again and is told the stored answers, and so goes
    on as if nothing had happened.
    """
    progress(f"{len(config.rigs)} rigs: operating points")
    trials = _search(config, stage, progress, jobs)
    nearest = min(trials, key=lambda trial: trial.verdict.score)
    best = nearest if nearest.verdict.cost is not None else None
    progress("the start and the best, on the nominal rig")
    on = loop_setup(variation(config.start.rig, config.rigs[0]))
    runs = {what: _runs(config, trial, on) for what, trial in (("start", trials[0]), ("best", nearest))}
    metrics = {
        "best": None if best is None else _best(config, best),
        "missed": nearest.verdict.missed,
        "trials": [_line(config, trial) for trial in trials],
    }
    page = tune_page(config, trials, nearest, runs)
    files = {} if best is None else _files(config, best)
    tables = {
        f"step-{what}-{wanted}": {"t [s]": run.record.t, **run.record.signals}
        for what, found in runs.items()
        for wanted, run in found.items()
    }
    return Outcome(metrics, page, step_figure(config, config.start.scenarios[0], runs), tables, files)


def _search(config: TuneConfig, stage: Stage, progress: Progress, jobs: int) -> list[Trial]:
    """TOGETHER designs are asked for at a time, however many processes judge them: the search is the same on any."""
    import optuna  # loads slowly, and no other command needs it

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    space: dict[str, Any] = {
        one.name: optuna.distributions.FloatDistribution(one.low, one.high, log=one.log) for one in config.searched
    }
    sampler = optuna.samplers.TPESampler(seed=config.seed, multivariate=True, constant_liar=True)
    study = optuna.create_study(sampler=sampler)
    study.enqueue_trial({one.name: one.start for one in config.searched})
    trials: list[Trial] = []
    with process_pool(jobs, partial(_judge, config)) as judged:
        while len(trials) < config.trials:
            asked = [study.ask(space) for _ in range(min(TOGETHER, config.trials - len(trials)))]
            values = [{one.name: one.rounded(each.params[one.name]) for one in config.searched} for each in asked]
            items = {f"trial-{len(trials) + i:05d}": each for i, each in enumerate(values)}
            for each, tried, kept in zip(asked, values, judged(items, stage, lambda _: None), strict=True):
                trials.append(Trial(len(trials), tried, Verdict(**kept)))
                study.tell(each, trials[-1].verdict.score)
                progress(f"trial {len(trials)} of {config.trials}: {_word(trials[-1].verdict)}; {_best_word(trials)}")
    return trials


def _judge(config: TuneConfig) -> Callable[[Mapping[str, float]], dict[str, Any]]:
    """The work of one process."""
    goals = Goals(config)
    return lambda values: asdict(goals.judge(values))


def _word(verdict: Verdict) -> str:
    return f"cost {verdict.cost:.4g}" if verdict.cost is not None else f"misses: {verdict.missed}"


def _best_word(trials: list[Trial]) -> str:
    costs = [trial.verdict.cost for trial in trials if trial.verdict.cost is not None]
    return f"best {min(costs):.4g}" if costs else "none yet meets every goal"


def _runs(config: TuneConfig, trial: Trial, on: LoopSetup) -> dict[str, LoopRun]:
    """A design on the nominal rig, by scenario."""
    chosen = config.design(trial.values)
    return {wanted.name: play(chosen, wanted, on) for wanted in config.start.scenarios}


def _numbers(config: TuneConfig, values: Mapping[str, float]) -> dict[str, dict[str, Any]]:
    return {one.name: {"value": values[one.name], "unit": one.unit} for one in config.searched}


def _best(config: TuneConfig, best: Trial) -> dict[str, Any]:
    """The margins are the nominal rig's."""
    rows = best.verdict.rows
    margins = {key: rows[0][key] for key in ("ms", "gain_margin_db", "phase_margin_deg")}
    return {
        "controller": config.name,
        "trial": best.number,
        "cost": best.verdict.cost,
        "numbers": _numbers(config, best.values),
        **margins,
        "worst_settling_s": _worst(rows, "settling_s"),
        "worst_overshoot_percent": _worst(rows, "overshoot_percent"),
        "rows": rows,
    }


def _worst(rows: list[dict[str, Any]], key: str) -> float | None:
    """Over rigs and scenarios; None where none has the number."""
    return max((row[key] for row in rows if row[key] is not None), default=None)


def _line(config: TuneConfig, trial: Trial) -> dict[str, Any]:
    verdict = trial.verdict
    told = {"cost": verdict.cost, "missed": verdict.missed, "miss": verdict.miss, "goals_left": verdict.left}
    return {"trial": trial.number, **told, "numbers": _numbers(config, trial.values)}


def _files(config: TuneConfig, best: Trial) -> dict[str, str]:
    """tuned.toml, a step experiment of the best design, and beside it the rig where that is no bundled one."""
    bundled = config.rig_name in bundled_rigs()
    table = config.step_table(best.values, config.rig_name if bundled else "rig.toml")
    note = f"# {config.name} as tuned: trial {best.number} of {config.trials} from seed {config.seed}.\n"
    files = {"tuned.toml": note + tomli_w.dumps(table)}
    return files if bundled else {**files, "rig.toml": rig_text(config.start.rig)}
