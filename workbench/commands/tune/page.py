"""The report of a search: its cost, the best design's numbers and rows, and its steps beside the start's."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from ...base.words import counted
from ...loop.envelope import DRAWN
from ...loop.rows import LinearLoops
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...loop.tuning.goals import Trial
from ...loop.tuning.problem import TuneProblem, weight_unit
from ...report import Curve, Figure, Page, Panel, Section, Table
from ..common.fitted_plant import with_fit
from ..common.judged import judged_words
from ..common.loop_margins import margins_section
from ..common.metric_table import MetricView
from ..common.time_figure import time_figure
from .options import TuneConfig

Runs = Mapping[str, Mapping[str, LoopRun]]  # of the start and the best, by scenario


def tune_page(
    config: TuneConfig,
    trials: Sequence[Trial],
    nearest: Trial,
    runs: Runs,
    rows: Sequence[Mapping[str, Any]],
    loops: Mapping[str, LinearLoops],
) -> Page:
    """The report. `nearest` is the best design, or where none meets the hard goals the one that comes nearest; `loops`
    are the linear ones of start and best on the nominal rig."""
    tables = [
        numbers_table(config.problem, trials[0], nearest),
        goals_table(nearest),
        *([_rows(config, rows)] if rows else []),
    ]
    page = Page(
        f"{config.name} tuned on {config.rig_name}",
        _verdict(config, trials, nearest, rows),
        [
            Section("The best design" if rows else "The nearest design", tables),
            Section("Its steps", [step_figure(config, scenario, runs, rows) for scenario in config.start.scenarios]),
            margins_section("Margins and Bode, on the nominal rig", loops, config.start.signal),
            Section("The search", [cost_figure(trials), _missed(trials)]),
        ],
    )
    return with_fit(page, config.start.rig)


def _verdict(config: TuneConfig, trials: Sequence[Trial], nearest: Trial, rows: Sequence[Mapping[str, Any]]) -> str:
    cost = nearest.verdict.cost
    if cost is None:
        none = f"None of {counted(len(trials), 'design')} meets every hard goal."
        return f"{none} None that met those before met: {_goal(nearest)}."
    outcome = f"cost {cost:.4g} in trial {nearest.number + 1} of {len(trials)}, at the start {_before(trials[0])}"
    if nearest.number == 0:
        outcome = f"none of {counted(len(trials), 'design')} is better than the start, which costs {cost:.4g}"
    told = reached(rows, [each.name for each in config.start.scenarios if each.arrives is not None])
    return f"{config.name}: {outcome}. On {counted(len(config.rigs), 'rig')} {', '.join(told)}."


def reached(rows: Sequence[Mapping[str, Any]], arriving: Collection[str]) -> list[str]:
    """What rows of rigs in scenarios, the nominal rig's first, came to: settling of those that are `arriving`,
    overshoot and Ms; nothing of what no row has."""
    settling = [row["settling_s"] for row in rows if row["scenario"] in arriving]
    settled, never = [each for each in settling if each is not None], settling.count(None)
    told = [f"settled in {max(settled):.3g} s at the latest"] if settled else []
    if never:
        told = [f"{never} of {counted(len(settling), 'run')} never settled", *(f"the others {each}" for each in told)]
    overshoots, ms = ([row[key] for row in rows if row[key] is not None] for key in ("overshoot_percent", "ms"))
    told += [f"overshoot {max(overshoots):.1f} % at most"] if overshoots else []
    told += [f"Ms {max(ms):.2f} at most"] if ms else []
    return [*told[:-1], f"{told[-1]} and {rows[0]['ms']:.2f} on the nominal one"] if ms and rows[0]["ms"] else told


def _before(start: Trial) -> str:
    cost = start.verdict.cost
    return f"{cost:.4g}" if cost is not None else f"none (it misses: {_goal(start)})"


def _goal(trial: Trial) -> str:
    return str(trial.verdict.missed)


def numbers_table(problem: TuneProblem, start: Trial, best: Trial) -> Table:
    """The searched numbers at the start and in the best design."""
    rows = [
        [n.name, start.values[n.name], best.values[n.name], n.unit, f"{n.low:g} to {n.high:g}"]
        for n in problem.searched
    ]
    weights = ", ".join(f"{key} {value:g} {weight_unit(key)}" for key, value in problem.weights.items())
    note = (
        "Cost: each number half by the nominal rig's worst, half by that of every plant, averaged over the scenarios, "
        f"times the weights: {weights}. Settling and overshoot of steps; IAE over the step, or over the band of a load."
    )
    return Table("Numbers", ["number", "start", "best", "unit", "searched"], rows, note)


def goals_table(trial: Trial) -> Table:
    """By how much a design meets each hard goal, and where in the envelope it is worst."""
    rows = [
        [goal.name, "missed" if goal.miss else "met", goal.value, goal.limit, goal.where]
        for goal in trial.verdict.goals
    ]
    note = "Over the rigs of the set at every position, null and moving, and the bad corner of all declared bounds"
    if trial.drawn:
        note += f", and {trial.drawn} of {DRAWN} drawn plants"
        note += ": those hardest for the designs that led" if trial.drawn < DRAWN else ""
    note += "; linear goals and noise first, then the nonlinear plant without noise."
    return Table("Hard goals", ["goal", "", "worst", "limit", "where"], rows, note)


def _rows(config: TuneConfig, rows: Sequence[Mapping[str, Any]]) -> Table:
    keys = ("scenario", "rig", "settling_s", "band", "overshoot_percent", "residual_oscillation", "peak_deviation")
    note = "Margins are those at mid stroke, the worse of null and moving. "
    note += judged_words(config.start.conditions, config.start.rig)
    maker = MetricView.of(config.start.rig, config.start.signal, config.start.scenarios)
    return maker.table("On every rig of the set", rows, (*keys, "ms", "gain_margin_db"), note)


def step_figure(config: TuneConfig, scenario: Scenario, runs: Runs, rows: Sequence[Mapping[str, Any]]) -> Figure:
    """One scenario on the nominal rig, by the start and the best: controlled signal and command."""
    own = {what: by_scenario[scenario.name] for what, by_scenario in runs.items()}
    return time_figure(scenario.name, config.start.signal, own, ("command",), scenario, rows)


def cost_figure(trials: Sequence[Trial]) -> Figure:
    """Cost of every design that meets the hard goals, and the best so far."""
    met = [(trial.number + 1, trial.verdict.cost) for trial in trials if trial.verdict.cost is not None]
    numbers, costs = np.array([n for n, _ in met], float), np.array([c for _, c in met], float)
    best = np.minimum.accumulate(costs)
    panel = Panel("cost [1]", [Curve("a design", numbers, costs, "markers"), Curve("best so far", numbers, best)])
    note = f"{len(met)} of {len(trials)} designs meet every hard goal and so have a cost; trial 1 is the start. "
    note += "A cost is on the drawn plants that counted when it was last judged."
    return Figure("Cost over the search", "trial", [panel], note=note)


def _missed(trials: Sequence[Trial]) -> Table:
    """How many designs fell at which goal, the latest goal first."""
    left = {trial.verdict.missed: trial.verdict.left for trial in trials}
    goals = sorted((goal for goal in left if goal is not None), key=lambda goal: left[goal])
    rows: list[list[Any]] = [["met every one", sum(trial.verdict.missed is None for trial in trials)]]
    rows += [[goal, sum(trial.verdict.missed == goal for trial in trials)] for goal in goals]
    rows.append(["all designs", len(trials)])
    return Table("Which goal the designs missed first", ["first goal that was missed", "designs"], rows)
