"""The report of a training: whether the policy beats what it stands on, its steps, goals, and the runs."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...base.words import counted, spanned
from ...loop.envelope import DRAWN
from ...loop.tuning.goals import Trial, Verdict
from ...report import Curve, Figure, Page, Panel, Section, Table
from ..common.metric_table import MetricView
from ..tune.page import Runs, goals_table, step_figure
from .options import TrainConfig
from .policies import TrainingRun

Rows = Mapping[str, Sequence[Mapping[str, Any]]]
Unseen = Sequence[Mapping[str, Any]]
_COMPARED = ("scenario", "rig", "controller", "settling_s", "overshoot_percent", "iae", "ms", "gain_margin_db")


def train_page(
    config: TrainConfig,
    runs: Sequence[TrainingRun],
    best: TrainingRun,
    start: Verdict,
    rows: Rows,
    unseen: Unseen,
    steps: Runs,
) -> Page:
    """The report; `start` is the verdict of the law with the network that it was given, or one that adds nothing.

    `rows` are those of start and trained on the rigs of the set, `unseen` those of `unseen_rows`.
    """
    judged = Trial(best.nearest.number, best.nearest.values, best.verdict, DRAWN if config.factors else 0)
    figures = [step_figure(config, scenario, steps, rows["trained"]) for scenario in config.start.scenarios]
    tables = [*([_unseen(config, unseen)] if unseen else []), _compared(config, rows), goals_table(judged)]
    return Page(
        f"{config.name} trained on {config.rig_name}",
        _verdict(config, runs, best, start, unseen),
        [
            Section("Its steps", figures),
            Section("On the envelope", tables),
            Section("The runs", [_curves(runs), _runs(runs)]),
        ],
    )


def _verdict(
    config: TrainConfig, runs: Sequence[TrainingRun], best: TrainingRun, start: Verdict, unseen: Unseen
) -> str:
    cost, before = best.verdict.cost, start.cost
    plants = f"{DRAWN} drawn plants" if config.factors else "the rigs of the set"
    if cost is None:
        count = sum(len(run.trials) for run in runs)
        return f"None of {count} policies meets every hard goal on {plants}; the nearest misses: {best.verdict.missed}."
    if before is None:
        return f"The policy meets every hard goal on {plants}; the start misses: {start.missed}. {_spread(runs)}."
    costs = f"cost {cost:.4g} instead of {before:.4g} on {plants}"
    if cost >= before:
        return f"The policy does not beat {config.name} without it: {costs}. {_spread(runs)}."
    share = f"{100 * (1 - cost / before):.1f} %"
    return " ".join(
        [f"The policy beats {config.name} without it by {share}: {costs}. {_spread(runs)}.", *_on_unseen(unseen)]
    )


def _on_unseen(unseen: Unseen) -> Iterator[str]:
    """A sentence: how soon steps settle, and the margins."""
    for start, trained in _pairs(unseen):
        keys = ("settling_p99_s", "settling_worst_s", "ms_worst")
        if None not in [row[key] for row in (start, trained) for key in keys]:
            late, slowest, ms = (f"{trained[key]:.3g} instead of {start[key]:.3g}" for key in keys)
            yield (
                f"On {counted(start['plants'], 'plant')} that no run has seen, 99 % settle {start['scenario']} within "
                f"{late} s, the slowest within {slowest} s, with Ms {ms} at worst."
            )


def _pairs(unseen: Unseen) -> Iterator[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Rows of start and trained, scenario by scenario."""
    designs = [[row for row in unseen if row["design"] == name] for name in ("start", "trained")]
    yield from zip(*designs, strict=True)


def _spread(runs: Sequence[TrainingRun]) -> str:
    costs = [run.verdict.cost for run in runs if run.verdict.cost is not None]
    lost = f", {len(runs) - len(costs)} without one" if len(costs) < len(runs) else ""
    return f"Costs of {counted(len(runs), 'run')}: {spanned(costs)}{lost}"


def _unseen(config: TrainConfig, unseen: Unseen) -> Table:
    keys = ("scenario", "design", "unstable", "tripped", "settling_p50_s", "settling_p99_s", "settling_worst_s")
    keys += ("overshoot_worst_percent", "iae_mean", "ms_worst")
    rows = [row for pair in _pairs(unseen) for row in pair]
    note = "Drawn as those of the search, by another seed; with noise and computing delay."
    title = f"On {counted(unseen[0]['plants'], 'plant')} that no run has seen"
    return MetricView.of(config.start.rig, config.start.signal).table(title, rows, keys, note)


def _compared(config: TrainConfig, rows: Rows) -> Table:
    """Every rig of the set in every scenario, without the policy and with it."""
    designs = zip(rows["start"], rows["trained"], strict=True)
    lines = [{**row, "controller": what} for pair in designs for what, row in zip(rows, pair, strict=True)]
    maker = MetricView.of(config.start.rig, config.start.signal, config.start.scenarios)
    return maker.table("On every rig of the set", lines, _COMPARED)


def _curves(runs: Sequence[TrainingRun]) -> Figure:
    curves = []
    for run in runs:
        at, cost = zip(*((k, c) for k, c in run.curve if c is not None), strict=True) if _any_cost(run) else ((), ())
        curves.append(Curve(f"seed {run.seed}", np.array(at, float), np.array(cost, float)))
    note = "The least cost so far, on the drawn plants that counted when a design was judged last."
    return Figure("Cost over the evaluations", "evaluation", [Panel("cost [1]", curves)], note=note)


def _any_cost(run: TrainingRun) -> bool:
    return any(cost is not None for _, cost in run.curve)


def _runs(runs: Sequence[TrainingRun]) -> Table:
    lines = [
        [run.seed, len(run.trials), run.nearest.number + 1, run.verdict.cost, run.verdict.missed or ""] for run in runs
    ]
    heads = ["seed", "evaluations", "best at", "cost on all drawn plants [1]", "misses"]
    return Table("Runs", heads, lines)
