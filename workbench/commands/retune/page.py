"""The report of a retuning: what was gained on the found rig, steps of both controllers on both rigs, the numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...base.units import from_si
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...plant import build
from ...records import Record
from ...report import Figure, Page, Section, Table
from ..common.judged import judged_words
from ..common.time_figure import time_figure
from ..tune.config import TuneConfig
from ..tune.goals import Trial
from ..tune.page import cost_figure, goals_table, numbers_table
from .config import RetuneConfig

Pair = tuple[str, str]  # old or retuned, on the declared or the found rig
Rows = Sequence[Mapping[str, Any]]
_SHORTEST = 0.2  # s
_TOLD = {  # name, unit, and the word for a number that does not exist
    "settling_s": ("settling", " s", "never"),
    "overshoot_percent": ("overshoot", " %", "none"),
    "ms": ("Ms", "", "none"),
    "gain_margin_db": ("gain margin", " dB", "none"),
}


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
            Section("What it buys", [_rows_table(config, rows), *_unseen(found)]),
            Section("Steps", [steps_figure(found, each, runs, rows) for each in found.start.scenarios]),
            Section("The numbers", [numbers_table(found.problem, trials[0], nearest), goals_table(nearest)]),
            Section("The search", [cost_figure(trials)]),
        ],
    )


def steps_figure(
    config: TuneConfig, scenario: Scenario, runs: Mapping[Pair, Mapping[str, LoopRun]], rows: Rows
) -> Figure:
    """One scenario by both controllers on both rigs, from where it starts; a step as far as it tells."""
    settled = [row["settling_s"] for row in rows if row["scenario"] == scenario.name and row["settling_s"] is not None]
    shown = max(_SHORTEST, 2 * max(settled, default=scenario.duration)) if scenario.is_step else scenario.duration
    records = {f"{what}, {where}": _record(runs[what, where][scenario.name], scenario, shown) for what, where in runs}
    return time_figure(f"{scenario.name}, from its start", config.start.signal, records, ("command",))


def _record(run: LoopRun, scenario: Scenario, shown: float) -> Record:
    """The part that is shown, its controlled signal and reference from where they start."""
    record = run.record
    rows = record.t <= shown
    start = record.signals["reference"][0] - scenario.reference(record.t[:1])[0]
    moved = {name: record.signals[name] - start for name in ("reference", scenario.signal)}
    signals = {name: values[rows] for name, values in {**record.signals, **moved}.items()}
    return replace(
        record, t=record.t[rows], signals=signals, valid={name: record.valid[name][rows] for name in signals}
    )


def _verdict(config: TuneConfig, old: Trial, nearest: Trial, metrics: Mapping[str, Any]) -> str:
    gain, count = metrics["gain"], metrics["trials"]
    told = [f"{name} {_change(gain[key], unit, none)}" for key, (name, unit, none) in _TOLD.items()]
    said = f"{metrics['scenario']} on the rig as found, {config.name} retuned: {', '.join(told)}."
    if nearest.verdict.missed is not None:
        return f"{said} No design of {count} meets every hard goal there; the nearest misses {_missed(nearest)}."
    if old.verdict.missed is not None:
        return f"{said} Over the rigs about it the old numbers miss {_missed(old)}; the new ones meet every hard goal."
    return said + (" No other design is better than the old one." if nearest is old else "")


def _missed(trial: Trial) -> str:
    """The goal that a design misses, with its worst number where it has one."""
    goal = next((goal for goal in trial.verdict.goals if goal.miss), None)
    if goal is None or goal.value is None:
        return f"{trial.verdict.missed}{f' ({goal.where})' if goal else ''}"
    return f"{goal.name}, {goal.value:.3g} with a limit of {goal.limit:g}, on {goal.where}"


def _change(pair: Sequence[float | None], unit: str, none: str) -> str:
    before, after = (none if value is None else f"{value:.3g}{unit}" for value in pair)
    return f"{after} instead of {before}"


def _rows_table(config: RetuneConfig, rows: Rows) -> Table:
    signal = config.found.start.signal
    shown = float(from_si(1.0, signal.unit, signal.si))
    heads = {
        "scenario": ("scenario", None), "rig": ("rig", None), "controller": ("controller", None),
        "settling_s": ("settling [s]", 1.0), "overshoot_percent": ("overshoot [%]", 1.0),
        "steady_state_error": (f"final error [{signal.unit}]", shown), "iae": (f"IAE [{signal.unit} s]", shown),
        "peak_deviation": (f"peak deviation [{signal.unit}]", shown),
        "residual_oscillation": ("oscillation [% of step]", 100.0), "ms": ("Ms [1]", 1.0),
        "gain_margin_db": ("gain margin [dB]", 1.0), "phase_margin_deg": ("phase margin [deg]", 1.0),
        "margins": ("margins by", None), "stable": ("stable", None), "tripped": ("tripped", None),
    }  # fmt: skip
    heads = {key: head for key, head in heads.items() if any(row[key] is not None for row in rows)}
    order = {name: i for i, name in enumerate(dict.fromkeys(row["scenario"] for row in rows))}
    lines = sorted(rows, key=lambda row: (order[row["scenario"]], row["rig"] != "found", row["controller"] != "old"))
    cells = [
        [row[key] if factor is None or row[key] is None else row[key] * factor for key, (_, factor) in heads.items()]
        for row in lines
    ]
    rigs = f"Declared: {config.declared.start.rig.name}; found: {config.found.start.rig.name}. "
    note = rigs + "At mid stroke; margins are the worse of null and moving. "
    note += judged_words(config.found.start.conditions, config.found.start.rig)
    return Table("Old and retuned on both rigs", [head for head, _ in heads.values()], cells, note)


def _unseen(config: TuneConfig) -> list[str]:
    """What the linear margins leave out of the found rig."""
    dry = build(config.start.rig).dry_friction
    names = [use.name for use in config.start.rig.effects if any(key.startswith(f"{use.name}.") for key in dry)]
    if not names:
        return []
    return [f"Linear margins are without {' and '.join(names)}; steps, lasting oscillation and the search have it."]
