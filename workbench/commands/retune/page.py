"""The report of a retuning: what was gained on the found rig, steps of both controllers on both rigs, the numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

from ...base.words import counted
from ...loop.metrics import METRICS
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...loop.tuning.goals import Trial
from ...plant import build
from ...report import Figure, Page, Section, Table
from ..common.judged import judged_words
from ..common.metric_table import MetricView
from ..common.time_figure import Columns, run_columns, time_figure
from ..tune.options import TuneConfig
from ..tune.page import cost_figure, goals_table, numbers_table
from .config import RetuneConfig

Pair = tuple[str, str]  # old or retuned, on the declared or the found rig
Rows = Sequence[Mapping[str, Any]]
_SHORTEST = 0.2  # s
_TOLD = ("settling_s", "overshoot_percent", "ms", "gain_margin_db")


def retune_page(
    config: RetuneConfig,
    trials: Sequence[Trial],
    nearest: Trial,
    runs: Mapping[Pair, Mapping[str, LoopRun]],
    metrics: Mapping[str, Any],
) -> Page:
    """The report, from the trials on the found rig, runs by controller and rig, and the metrics."""
    found, rows = config.found, metrics["rows"]
    return Page(
        f"{found.name} retuned on {found.start.rig.name}",
        _verdict(found, trials[0], nearest, metrics),
        [
            Section("What it gains", [_rows_table(config, rows), *_unseen(found, rows)]),
            Section("Steps", [steps_figure(found, each, runs, rows) for each in found.start.scenarios]),
            Section("The numbers", [numbers_table(found.problem, trials[0], nearest), goals_table(nearest)]),
            Section("The search", [cost_figure(trials)]),
        ],
    )


def steps_figure(
    config: TuneConfig, scenario: Scenario, runs: Mapping[Pair, Mapping[str, LoopRun]], rows: Rows
) -> Figure:
    """One scenario by both controllers on both rigs, from where it starts; a step as far as it tells."""
    own = {f"{what}, {where}": _columns(by[scenario.name], scenario) for (what, where), by in runs.items()}
    return time_figure(f"{scenario.name}, from its start", config.start.signal, own, ("command",), scenario, rows)


def _columns(run: LoopRun, scenario: Scenario) -> Columns:
    """A run, its controlled signal and reference from where they start."""
    columns = run_columns(run)
    start = columns["reference"][0] - scenario.reference(run.record.t[:1])[0]
    return {**columns, **{name: columns[name] - start for name in ("reference", scenario.signal)}}


def _verdict(config: TuneConfig, old: Trial, nearest: Trial, metrics: Mapping[str, Any]) -> str:
    gain, count = metrics["gain"], metrics["trials"]
    told = [f"{METRICS[key].name} {_change(gain[key], key)}" for key in _TOLD]
    said = f"{metrics['scenario']} on the found rig, {config.name} retuned: {', '.join(told)}."
    if nearest.verdict.missed is not None:
        return f"{said} No design of {count} meets every hard goal there; the nearest misses {_missed(nearest)}."
    if old.verdict.missed is not None:
        return f"{said} Over the rigs about it the old numbers miss {_missed(old)}; the new ones meet every hard goal."
    return said + (f" It is the old one: of {counted(count, 'design')} none is better." if nearest is old else "")


def _missed(trial: Trial) -> str:
    """The goal that a design misses, with its worst number where it has one."""
    goal = next((goal for goal in trial.verdict.goals if goal.miss), None)
    if goal is None or goal.value is None:
        return f"{trial.verdict.missed}{f' ({goal.where})' if goal else ''}"
    return f"{goal.name}, {goal.value:.3g} with a limit of {goal.limit:g}, on {goal.where}"


def _change(pair: Sequence[float | None], key: str) -> str:
    none = "never" if key == "settling_s" else "none"
    before, after = (none if value is None else MetricView().text(value, key) for value in pair)
    return f"{after} instead of {before}"


def _rows_table(config: RetuneConfig, rows: Rows) -> Table:
    keys = ("scenario", "rig", "controller", "settling_s", "overshoot_percent", "steady_state_error", "iae")
    keys += ("peak_deviation", "residual_oscillation", "ms", "gain_margin_db", "phase_margin_deg", "margins", "stable")
    lines = sorted(rows, key=lambda row: (row["rig"] != "found", row["controller"] != "old"))
    rigs = f"Declared: {config.declared.start.rig.name}; found: {config.found.start.rig.name}. "
    note = rigs + "Margins are those at mid stroke, the worse of null and moving. "
    note += judged_words(config.found.start.conditions, config.found.start.rig)
    start = config.found.start
    maker = MetricView.of(start.rig, start.signal, start.scenarios)
    return maker.table("Old and retuned on both rigs", lines, (*keys, "tripped"), note)


def _unseen(config: TuneConfig, rows: Rows) -> list[str]:
    """What the linear margins of a row leave out of the found rig."""
    dry = build(config.start.rig).dry_friction
    names = [use.name for use in config.start.rig.effects if any(key.startswith(f"{use.name}.") for key in dry)]
    if not names or all(row["margins"] != "linear" for row in rows):
        return []
    return [f"Linear margins are without {' and '.join(names)}; steps, lasting oscillation and the search have it."]
