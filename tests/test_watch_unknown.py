"""What a watch does not know it does not say: changes without a name, remarks that are no repair, oil that was not
measured once."""

from dataclasses import replace

import numpy as np
import pytest
from made_campaigns import campaign
from test_watch import wandering, watched

from workbench.base.process_pool import one_blas_thread
from workbench.commands.watch.page import verdict
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.watch.changes import Change, all_told, first_told
from workbench.identify.watch.forecast import forecasts, unforeseen
from workbench.identify.watch.history import history
from workbench.identify.watch.naming import Explained, Name
from workbench.identify.watch.session_evidence import HELD, OF_SCALE, Axis, SessionEvidence, near_fit, rig_as_found
from workbench.identify.watch.smoothed import smoothed
from workbench.identify.watch.told import NamedChange, _as_it_went, numbers_then
from workbench.records.dated_sessions import dated_sessions
from workbench.rigs.rig_file import load_rig

DAYS = 7.0 * np.arange(12)
NAMED = NamedChange(
    Change(0, "drift", 5, 3.0, 1.0, 4, 6),
    7,
    Name("Km", ("Km",), 0.9),
    "Km [1]",
    {t: (0.1 * t, 0.01) for t in range(4, 12)},
    {t: {"Km": 1 + 0.1 * t} for t in range(4, 12)},
    (5.0, 4.0, 6.0),
    "1/year",
    ("Km",),
    {t: DAYS[t] for t in range(4, 12)},
)
UNNAMED = NamedChange(NAMED.change, 7, Name(None, ("Km",), 0.37), "", {}, {}, None, "", (), {})


def test_without_a_name_neither_the_loop_nor_what_comes_of_it_is_known():
    assert [UNNAMED.is_unknown(t) for t in (3, 4, 11)] == [False, True, True]
    mended = replace(UNNAMED, change=replace(UNNAMED.change, end=9))
    assert [mended.is_unknown(t) for t in (8, 9)] == [True, False]
    assert not any(NAMED.is_unknown(t) for t in range(12))
    assert numbers_then([NAMED], DAYS[-1], DAYS)["Km"] == pytest.approx(2.1)
    assert numbers_then([UNNAMED], DAYS[-1], DAYS) == {}
    assert "has no name" in unforeseen(UNNAMED)
    rows, why = forecasts(None, UNNAMED, {}, {}, None, None, None)
    assert not rows
    assert "has no name" in why


def test_what_an_unknown_or_a_named_change_does_to_the_loop_is_said_in_db():
    margins = [12.0, 12.1, 11.8, 11.0, 10.2, 9.7, 9.1, 8.4]
    sessions = [
        {"date": f"2026-01-{k + 1:02}", "margins": {"gain_margin_db": value}} for k, value in enumerate(margins)
    ]
    rate = {"value": 2.56, "low": 2.0, "high": 3.0, "unit": "typical/year"}
    alarm = {
        "effect": "main.deadband", "among": ["main.deadband"], "rate": rate, "shape": "drift", "since": "2026-01-04",
        "since_between": ["2026-01-03", "2026-01-05"], "told": "2026-01-06", "until": None,
    }  # fmt: skip
    metrics = {"sessions": sessions, "alarms": [alarm], "forecast": [], "controller": "PID"}
    assert "by which the gain margin goes from 11.8 to 8.4 dB; told on" in verdict(metrics, None)
    unknown = {**alarm, "effect": None, "rate": None}
    said = verdict({**metrics, "alarms": [unknown]}, None)
    assert said.startswith("Something that no suspect explains (nearest: main.deadband) changed since 2026-01-04;")


@pytest.mark.parametrize("told", [4, 7, 11])
def test_a_change_has_begun_with_the_session_that_it_was_told_after(told):
    """Its course would put the beginning at session 8."""
    values = {t: Explained(2.0, 1.0, 10, max(t - 7.0, 0.0), 0.1, {}) for t in range(12)}
    gone = _as_it_went(DAYS, NAMED.change, told, values)
    assert gone.first <= told
    assert gone.first == min(told, 8)


@pytest.mark.parametrize(
    ("remark", "repair"),
    [
        ("nothing changed", False), ("unchanged", False), ("new operator", False), ("in service", False),
        ("no repair", False), ("oil to be changed", False), ("operator changed", False), ("new specimen", False),
        ("oil changed", True), ("new seals", True), ("servo-valve exchanged", True), ("filter change", True),
        ("nothing found, seal replaced", True), ("serviced", True), ("new pressure transducer", True),
    ],
)  # fmt: skip
def test_a_remark_that_nothing_was_mended_is_no_repair(remark, repair, tmp_path):
    folder = tmp_path / "2026-01-05"
    folder.mkdir()
    (folder / "campaign.toml").write_text(f'rig = "jack-10t"\nremark = "{remark}"\n')
    assert dated_sessions(tmp_path).sessions[0].repair is repair


def test_a_repair_before_every_session_leaves_nothing_to_tell():
    assert all_told(watched(wandering(20, 0), repairs=[True] * 20), 0.5) == []


def test_one_session_without_the_oil_s_temperature_leaves_the_others_theirs():
    """The season moves the friction by half, which is known from the temperatures."""
    kelvin = 300 + 8.0 * np.sin(2 * np.pi * np.arange(52) / 52)
    moves = wandering(52, 6)
    moves[:, 0] += -0.1 * (kelvin - 300) / 0.45
    temperatures = [None if k == 30 else value for k, value in enumerate(kelvin)]
    known = watched(moves, 6, temperatures=temperatures)
    assert known.kelvin[30] == kelvin[29]
    assert first_told(known, 0.5)[0] is None
    half = [value if k % 2 else None for k, value in enumerate(kelvin)]
    assert watched(moves, 6, temperatures=half).kelvin is None


def test_axes_that_change_nothing_together_are_parted_by_what_is_near_one():
    """A number and a transducer's scale that nearly cancel. What a first order leaves of every session alike would move
    both by as much as it likes: the calibration says that it did not."""
    axes = (
        Axis("V0", "m^3", scale=0.1, value=1.0, number=True),
        Axis("b", "N s/m", scale=0.45, value=1.0, healthy=1 / HELD, number=True),
        Axis("position.scale", "1", healthy=OF_SCALE),
    )
    freedom = np.array([1.0, 0.0, 0.1])  # 10 % more of V0, and a scale that is 10 % more
    random, sharp, left = np.random.default_rng(5), 400.0, 1.0
    off = []
    for _ in range(60):
        mix = np.array([[1.0, 0.3, 0.0], [0.2, 1.0, 0.5], [0.4, 0.1, 1.0]]) + 0.1 * random.standard_normal((3, 3))
        mix -= np.outer(mix @ freedom, freedom) / (freedom @ freedom)
        row = np.linalg.svd(mix)[0][:, -1]  # which the errors hardly tell
        mix += 5e-4 * np.outer(row, freedom)
        mean = np.array([0.0, 0.2, 0.002]) * random.standard_normal(3)
        sessions, moves = [], mean + np.array([0.02, 0.3, 0.002]) * random.standard_normal((24, 3))
        for move in moves:
            matrix = sharp**2 * mix.T @ mix
            vector = matrix @ move + sharp * mix.T @ (random.standard_normal(3) + left * row)
            sessions.append(SessionEvidence(axes, np.zeros(3), matrix, -vector, 1000, 1.0, {}))
        found, deviations = smoothed(history(sessions, list(7.0 * np.arange(24)), [False] * 24, [300.0] * 24))
        off.append((found[-1, 0] - moves[-1, 0]) / np.array([1.0, deviations[-1, 0]]))
    share, deviations_off = np.abs(off).T
    assert np.quantile(0.1 * share, 0.95) < 0.05  # of V0
    assert np.mean(deviations_off <= 1.96) >= 0.9


def test_a_supply_that_was_low_in_the_first_session_is_followed_in_the_others():
    """By 2.5 %, and 3 % high in a later one: held to less, what the fit left would be taken for a change."""
    rig = load_rig("festo-tp511")

    def problem(share, of):
        supply = replace(rig.numbers["Ps"], value=rig["Ps"] * (1 + share))
        return estimation_problem(campaign(replace(rig, numbers={**rig.numbers, "Ps": supply})), of)

    with one_blas_thread():
        found = rig_as_found(rig, problem(-0.025, rig))
        fit = near_fit(problem(0.03, found))
    assert "Ps" not in fit.at_bounds
    assert fit.chi2 < 1.1
