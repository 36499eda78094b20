"""Watch a rig: each session's evidence, what changes over all of them, what it is, and what that does to a loop."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.process_pool import one_blas_thread
from ...base.words import counted
from ...identify.watch.changes import Change, Telling, all_told
from ...identify.watch.forecast import forecasts
from ...identify.watch.healthy_rate import healthy_rate
from ...identify.watch.history import History, history
from ...identify.watch.known_then import NORMAL, intervals, known_then
from ...identify.watch.loop_costs import FIGURES, TunedLoop, loop_figures, rig_with
from ...identify.watch.naming import Name
from ...identify.watch.reader import SessionReader, read_sessions
from ...identify.watch.session_evidence import Axis, SessionEvidence
from ...identify.watch.smoothed import smoothed
from ...identify.watch.splitting import to_split
from ...identify.watch.told import NamedChange, named, numbers_then
from ...loop.drive_simulation import loop_inside
from ...records.campaign import FILE, campaign_rig
from ...records.dated_sessions import DatedSession, DatedSessions
from ...report import Figure, Page
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig
from ..common.design_numbers import Subject
from ..common.metric_table import MetricView
from ..common.outcome import Outcome, Progress, Stage
from ..common.step_experiment import StepConfig
from .page import watch_page
from .retuning import Retuning


def watched_rig(found: DatedSessions, given: str | None) -> Rig:
    """The rig that is given, else the one of the newest session whose rig file can be read. Raises InputError."""
    if given:
        return load_rig(given)
    for session in reversed(found.sessions):
        for place in (found.folder / session.name, found.folder):
            if (place / FILE).exists():
                return load_rig(campaign_rig(place))
    raise InputError(f"{found.folder}: no session names its rig; give --rig")


def identity(found: DatedSessions, rig: Rig, loop: StepConfig, a_year: float) -> dict[str, Any]:
    """What says that a watch is the same one."""
    days = [str(session.day) for session in found.sessions]
    return {"command": "watch", "folder": found.folder.resolve().name, "sessions": days, "rig": rig.table(),
            "loop": loop.source, "false_alarms_a_year": a_year}  # fmt: skip


def read_identity(folder: Path) -> list[str]:
    """The sessions of a folder, for what says that a watch is the same one."""
    return [folder.name, *sorted(path.parent.name for path in folder.glob(f"*/{FILE}"))]


def run_watch(
    found: DatedSessions,
    rig: Rig,
    loop: StepConfig,
    a_year: float,
    retuning: Retuning | None,
    stage: Stage,
    progress: Progress,
) -> Outcome:
    """The outcome of a watch. A session costs a fit once: its evidence stays in the user's cache."""
    left_out = list(found.left_out)
    reader = SessionReader(rig, progress)
    sessions, evidence = read_sessions(reader, found.sessions, left_out)
    for line in left_out:
        progress(f"left out: {line}")
    if not evidence:
        raise InputError(f"{found.folder}: no session can be read: {left_out[0]}")
    tuned = tuned_loop(loop, rig)
    days = [float((session.day - sessions[0].day).days) for session in sessions]
    with one_blas_thread():
        known = history(evidence, days, [s.repair for s in sessions], [s.temperature for s in sessions])
        progress(f"what changes over {counted(len(sessions), 'session')}")
        told = [one for each in all_told(known, a_year) for one in _named(reader, sessions, evidence, known, each)]
        lasting = next((each for each in told if each.change.end is None), None)
        moves, deviations = _course(known, [each.change for each in told])
        seen = intervals(rig, known, moves, deviations)
        usual = _usual(known, seen[0], [each.change for each in told])
        progress(f"{tuned.controller.name} on the rig of each session")
        costs = stage("loops", lambda: loop_figures(tuned, rig, known, *known_then(known), told))
        healthy = healthy_rate(known, a_year)
        newest = numbers_then(told, days[-1], known.days)
        asks = retuning if tuned.controller in loop.controllers else None  # nobody retunes the loop of somebody else
        again = stage("retuning", lambda: asks(rig_with(rig, newest))) if asks and newest else None
    forecast, no_forecast = forecasts(known, lasting, costs, usual, sessions[0].day, tuned, rig)
    metrics = {
        "sessions": [
            {
                "date": str(session.day),
                "chi2": each.chi2,
                "numbers": _numbers(known, seen[:, t]) | _of_the_names(told, t),
                "margins": {name: costs[name][t] for name in FIGURES},
                "remark": session.remark,
                "residuals": dict(each.residuals),
            }
            for t, (session, each) in enumerate(zip(sessions, evidence, strict=True))
        ],
        "alarms": [_alarm(each, sessions) for each in told],
        "forecast": forecast,
        "no_forecast": no_forecast,
        "retuning": again,
        "left_out": left_out,
        "false_alarms_a_year": a_year,
        "healthy": asdict(healthy) if healthy else None,
        "controller": tuned.controller.name,
    }

    def draw() -> tuple[Page, Figure]:
        name, shown = found.folder.resolve().name, MetricView.of(rig, loop.signal, loop.scenarios)
        return watch_page(name, known, sessions, seen, told, costs, metrics, shown)

    texts = {"watch.json": json.dumps(metrics, indent=1)}
    return Outcome(metrics, draw, {}, texts, Subject(rig, [tuned.controller]))


def tuned_loop(loop: StepConfig, rig: Rig) -> TunedLoop:
    """The first controller of an experiment in its first scenario; where the rig has a loop inside, and the experiment
    is of one that has none, that loop: what writes a valve's command says nothing of it."""
    inside = rig.inner if not loop.rig.inner else None
    return TunedLoop(loop_inside(inside) if inside else loop.controllers[0], loop.scenarios[0], loop.conditions)


def _usual(known: History, values: np.ndarray, changes: Sequence[Change]) -> dict[str, float]:
    """The rig's numbers in the mean over the sessions outside of changes, of values [T, n] SI; without those that one
    of these sessions does not tell."""
    well = _outside(known, changes)
    mean = values[well if len(well) else slice(None)].mean(axis=0)
    return {known.axes[k].name: float(mean[k]) for k in range(known.numbers) if np.isfinite(mean[k])}


def _course(known: History, changes: Sequence[Change]) -> tuple[np.ndarray, np.ndarray]:
    """Moves [T, n] of every session and their deviations; those outside of changes by such sessions alone: what changed
    is no first order any more."""
    moves, deviations = smoothed(known, changes)
    well = _outside(known, changes)
    if changes and len(well) > 1:
        moves[well], deviations[well] = smoothed(known.some(well))
    return moves, deviations


def _outside(known: History, changes: Sequence[Change]) -> np.ndarray:
    """The sessions outside of changes."""
    lives = [np.arange(each.earliest, len(known.days) if each.end is None else each.end) for each in changes]
    return np.setdiff1d(np.arange(len(known.days)), np.concatenate(lives or [np.arange(0)]))


def _named(
    reader: SessionReader,
    sessions: Sequence[DatedSession],
    evidence: Sequence[SessionEvidence],
    known: History,
    telling: Telling,
) -> list[NamedChange]:
    left, change = telling.left, telling.change
    usual = float(np.median([evidence[t].chi2 for t in left[: max(change.earliest, 1)]]))
    own = [sessions[t] for t in left]
    return [each.among(left) for each in named(reader, own, known.some(left), change, telling.told, usual)]


def _numbers(known: History, seen: np.ndarray) -> dict[str, list[float]]:
    """Each number of the rig, effect and sensor that a session tells: value, low, high (95 %), of [3, n] SI."""
    return {label(axis): seen[:, k].tolist() for k, axis in enumerate(known.axes) if np.isfinite(seen[0, k])}


def label(axis: Axis) -> str:
    """An axis with its unit, as watch.json and the page name it."""
    return f"{axis.name} [{axis.unit}]"


def _of_the_names(told: Sequence[NamedChange], session: int) -> dict[str, list[float]]:
    courses = {each.label: each.course[session] for each in told if session in each.course}
    return {label: [value + side * NORMAL * deviation for side in (0, -1, 1)]
            for label, (value, deviation) in courses.items()}  # fmt: skip


def _alarm(told: NamedChange, sessions: Sequence[DatedSession]) -> dict[str, Any]:
    change: Change = told.change
    name: Name = told.name
    rate: Mapping[str, Any] | None = None
    if told.rate:
        value, low, high = told.rate
        rate = {"value": value, "low": low, "high": high, "unit": told.rate_unit}
    return {
        "effect": name.axis,
        "among": list(name.among),
        "share": name.share if name.axis else None,
        "since": str(sessions[change.first].day),
        "since_between": [str(sessions[change.earliest - 1].day), str(sessions[change.latest].day)],
        "until": None if change.end is None else str(sessions[change.end].day),
        "shape": change.shape,
        "rate": rate,
        "times_limit": change.gain,
        "told": str(sessions[told.first_alarm].day),
        "record": to_split(name.among) if len(name.among) > 1 else [],
    }
