"""What a watch keeps: a new session changes nothing of earlier ones, and asks for its own fit alone."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from test_watch import wandering, watched

from workbench.base.errors import InputError
from workbench.base.private_cache import kept
from workbench.commands.common.shipped import experiment
from workbench.commands.watch.options import loop_of
from workbench.commands.watch.study import tuned_loop
from workbench.identify.watch import loop_costs, reader
from workbench.identify.watch.known_then import known_then
from workbench.identify.watch.loop_costs import FIGURES, loop_figures
from workbench.identify.watch.naming import Explained
from workbench.identify.watch.session_evidence import SessionEvidence
from workbench.identify.watch.smoothed import smoothed
from workbench.identify.watch.told import fitted_sessions
from workbench.records import load_campaign
from workbench.records.dated_sessions import dated_sessions
from workbench.rigs.rig_file import load_rig

RIG = load_rig("jack-10t")


def test_what_was_known_of_a_session_is_what_a_history_that_ends_there_says_of_it():
    known = watched(wandering(40, 3), 3)
    moves, deviations = known_then(known)
    for session in (0, 9, 15, 16, 30, 39):
        own, spread = smoothed(known.until(session + 1))
        np.testing.assert_allclose(moves[session], own[-1], atol=1e-7)
        np.testing.assert_allclose(deviations[session], spread[-1], rtol=1e-7)


@pytest.mark.parametrize("count", [9, 16, 30])
def test_later_sessions_change_nothing_of_what_was_known(count):
    kelvin = [300.0 + k % 5 for k in range(40)]
    moves, deviations = known_then(watched(wandering(40, 3), 3, temperatures=kelvin))
    before = known_then(watched(wandering(40, 3)[:count], 3, temperatures=kelvin[:count]))
    np.testing.assert_allclose(moves[:count], before[0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(deviations[:count], before[1], rtol=1e-9)


def test_a_new_session_asks_for_no_fit_but_its_own():
    """Up to twelve sessions from the one before the change on; the newest is always among them."""
    for count in range(10, 300):
        fitted, before = fitted_sessions(8, count), fitted_sessions(8, count - 1)
        assert set(fitted) - set(before) == {count - 1}
        assert min(fitted) == 8
        assert len(fitted) <= 13


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def test_a_rig_is_judged_once(cache, monkeypatch):
    judged = []
    monkeypatch.setattr(loop_costs, "loop_row", lambda loop, rig: judged.append(rig["b"]) or {"gain_margin_db": 9.0})
    monkeypatch.setattr(loop_costs, "_worst", lambda *_: 8.0)
    rig = load_rig("jack-10t")
    loop = tuned_loop(loop_of(experiment("position_tuned"), "p-dp"), load_rig("jack-10t"))
    known = watched(wandering(12, 3), 3)
    axes = tuple(replace(axis, value=rig[axis.name], scale=0.1 * rig[axis.name]) for axis in known.axes[:2])
    known = replace(known, axes=(*axes, *known.axes[2:]))
    for count in (11, 12):
        then = known_then(known.until(count))
        figures = loop_figures(loop, rig, known.until(count), *then, ())
        assert set(figures) == set(FIGURES)
        assert figures["gain_margin_db"] == [9.0] * count
        assert figures["settling_s"] == [None] * count
        assert len(judged) == count


def test_what_is_kept_is_computed_once_for_a_key(cache):
    calls = []

    def compute(key):
        calls.append(key)
        return {"twice": 2 * key["a"]}

    found = [kept("test", {"a": a}, partial(compute, {"a": a}))["twice"] for a in (1, 1, 2)]
    assert found == [2, 2, 4]
    assert calls == [{"a": 1}, {"a": 2}]


def test_a_watch_that_was_stopped_goes_on_where_it_was(cache, tmp_path, monkeypatch):
    read = []

    def evidence(problem, models):
        read.append(problem)
        if len(read) == 3:
            raise KeyboardInterrupt
        return SessionEvidence((), np.zeros(0), np.zeros((0, 0)), np.zeros(0), 1, 1.0, {})

    monkeypatch.setattr(reader, "rig_as_found", lambda rig, problem: rig)
    monkeypatch.setattr(reader, "_problem", lambda campaign, *_: campaign.path.name)
    monkeypatch.setattr(reader.SessionReader, "_models_of", lambda *_: ())
    monkeypatch.setattr(reader, "session_evidence", evidence)
    sessions = dated_sessions(four_days(tmp_path)).sessions
    with pytest.raises(KeyboardInterrupt):
        reader.read_sessions(reader.SessionReader(RIG, print), sessions, [])
    kept_sessions, _ = reader.read_sessions(reader.SessionReader(RIG, print), sessions, [])
    assert len(kept_sessions) == 4
    assert read == [f"2026-01-0{day}" for day in (1, 2, 3, 3, 4)]


def four_days(folder: Path) -> Path:
    for day in range(1, 5):
        own = folder / f"2026-01-0{day}"
        own.mkdir()
        rows = "".join(f"{k / 1000},0,{day + 1e-6 * k}\n" for k in range(40))
        (own / "a.csv").write_text(f"t [s],command [1],position [m]\n{rows}")
        (own / "b.csv").write_text(f"t [s],command [1],position [m]\n{rows}0.04,0,{day}\n")
        (own / "campaign.toml").write_text('rig = "jack-10t"\n[records]\ntrain = ["a.csv"]\nheldout = ["b.csv"]\n')
    return folder


def test_a_suspect_whose_fit_ends_far_off_leaves_the_others(cache, monkeypatch):
    def far(axes):
        if "current.scale" in axes:
            raise InputError("no nearer than a constant")
        return {axis: Explained(2.0, 1.0, 1000, 0.3, 0.1, {}) for axis in axes}

    monkeypatch.setattr(reader, "explainer", lambda *_: far)
    session = load_campaign(Path(__file__).parent.parent / "experiments" / "sample")
    own = reader.SessionReader(load_rig("jack-10t"), lambda _: None)
    asked = [("Kp",), ("current.scale",), ("psi3",), ("Kp", "psi3"), ("Kp", "current.scale")]
    found = own.explained(session, asked, "a session")
    assert set(found) == {("Kp",), ("psi3",), ("Kp", "psi3")}
    assert set(found["Kp", "psi3"]) == {"Kp", "psi3"}
