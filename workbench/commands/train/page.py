"""The report of a training: whether the policy beats what it stands on, its steps, goals, and the runs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...loop.envelope import DRAWN
from ...report import Curve, Figure, Page, Panel, Section, Table
from ..tune.goals import Trial, Verdict
from ..tune.page import Runs, goals_table, step_figure
from .config import TrainConfig
from .policies import Run

Rows = Mapping[str, Sequence[Mapping[str, Any]]]
_HEADS = {"settling_s": "settling [s]", "overshoot_percent": "overshoot [%]", "ms": "Ms [1]"}


def train_page(config: TrainConfig, runs: Sequence[Run], best: Run, start: Verdict, rows: Rows, steps: Runs) -> Page:
    """The report; `start` is the verdict of the law with the weights that it was given, or none."""
    judged = Trial(best.nearest.number, best.nearest.values, best.verdict, DRAWN if config.factors else 0)
    figures = [step_figure(config, scenario, steps, rows["trained"]) for scenario in config.start.scenarios]
    return Page(
        f"{config.name} trained on {config.rig_name}",
        _verdict(config, runs, best, start, rows),
        [
            Section("Its steps", figures),
            Section("On the envelope", [_compared(rows), goals_table(judged)]),
            Section("The runs", [_curves(runs), _runs(runs)]),
        ],
    )


def _verdict(config: TrainConfig, runs: Sequence[Run], best: Run, start: Verdict, rows: Rows) -> str:
    cost, before = best.verdict.cost, start.cost
    plants = f"{DRAWN} drawn plants" if config.factors else "the rigs of the set"
    if cost is None:
        count = sum(len(run.trials) for run in runs)
        return f"None of {count} policies meets every hard goal on {plants}; the nearest misses: {best.verdict.missed}."
    if before is None:
        return f"The policy meets every hard goal on {plants}; the start misses: {start.missed}. {_spread(runs)}."
    costs = f"cost {cost:.4g}, without the policy {before:.4g}, on {plants}"
    if cost >= before:
        return f"The policy does not beat {config.name} without it: {costs}. {_spread(runs)}."
    share = f"{100 * (1 - cost / before):.1f} %"
    return f"The policy beats {config.name} without it by {share}: {costs}; {_settled(rows)}. {_spread(runs)}."


def _spread(runs: Sequence[Run]) -> str:
    costs = [run.verdict.cost for run in runs if run.verdict.cost is not None]
    lost = f", {len(runs) - len(costs)} without one" if len(costs) < len(runs) else ""
    return f"Costs of the {len(runs)} runs: {min(costs):.4g} to {max(costs):.4g}{lost}"


def _settled(rows: Rows) -> str:
    """Of the first scenario with a step: the nominal rig, and the slowest of the set."""
    steps = [row["scenario"] for row in rows["start"] if row["settling_s"] is not None]
    times = {what: [row["settling_s"] for row in own if row["scenario"] in steps[:1]] for what, own in rows.items()}
    if not steps or any(None in values for values in times.values()):
        return "a step does not settle on every rig of the set"
    before, after = times["start"], times["trained"]
    return (
        f"{steps[0]} settles in {after[0]:.3g} s instead of {before[0]:.3g} s, on the slowest rig of the set in "
        f"{max(after):.3g} s instead of {max(before):.3g} s"
    )


def _compared(rows: Rows) -> Table:
    """Every rig of the set in every scenario, without the policy and with it."""
    lines = [
        [start["rig"], start["scenario"], *(value for key in _HEADS for value in (start[key], trained[key]))]
        for start, trained in zip(rows["start"], rows["trained"], strict=True)
    ]
    heads = ["rig", "scenario", *(text for head in _HEADS.values() for text in (f"{head}, start", "trained"))]
    return Table("On every rig of the set, without the policy and with it", heads, lines)


def _curves(runs: Sequence[Run]) -> Figure:
    curves = []
    for run in runs:
        at, cost = zip(*((k, c) for k, c in run.curve if c is not None), strict=True) if _any_cost(run) else ((), ())
        curves.append(Curve(f"seed {run.seed}", np.array(at, float), np.array(cost, float)))
    note = "The least cost so far, on the drawn plants that counted when a design was judged last."
    return Figure("Cost over the evaluations", "evaluation", [Panel("cost [1]", curves)], note=note)


def _any_cost(run: Run) -> bool:
    return any(cost is not None for _, cost in run.curve)


def _runs(runs: Sequence[Run]) -> Table:
    lines = [
        [run.seed, len(run.trials), run.nearest.number, run.verdict.cost, run.verdict.missed or ""] for run in runs
    ]
    heads = ["seed", "evaluations", "best at", "cost on all drawn plants [1]", "misses"]
    return Table("Runs", heads, lines)
