"""The guard that every loop passes: limits on what is commanded, trips on what is measured."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.loop.guarded_controller import Guard
from workbench.rigs.rig_file import bundled, load_rig

PERIOD = 1e-3
RATE = 200.0  # 1/s, the rig's
QUIET = {"position": 0.0, "force": 0.0}


@pytest.fixture
def guard(rig):
    return Guard(rig)


@given(st.lists(st.floats(-5, 5), min_size=1, max_size=30), st.floats(-1, 1))
def test_the_guard_limits_size_and_rate(rig, demands, start):
    slow = Guard(with_limit(rig, command_rate=50.0))
    slow.reset(start)
    held = start
    for demanded in demands:
        slow.watch(QUIET)
        command = slow.limit(demanded)
        wanted = held + np.clip(np.clip(demanded, -1, 1) - held, -50 * PERIOD, 50 * PERIOD)
        assert command == pytest.approx(wanted, abs=1e-12)
        assert abs(command) <= 1 + 1e-12
        held = command
    assert slow.tripped is None


def with_limit(rig, **values):
    limits = {name: replace(number, value=values.get(name, number.value)) for name, number in rig.limits.items()}
    return replace(rig, limits=limits)


def test_what_is_within_the_limits_passes(guard):
    for k in range(20):
        guard.watch({"position": 0.0049 * k - 0.1, "force": 89e3, "pa": 1e7})
        assert guard.limit(0.1) == pytest.approx(0.1)
    assert guard.tripped is None


@pytest.mark.parametrize("name", [name for name in bundled() if "position" in load_rig(name).sensors])
def test_a_noisy_position_at_rest_is_no_speed(name):
    """festo-tp511: 0.4 mm of noise, and a limit of 0.5 mm a period."""
    rest, random = load_rig(name), np.random.default_rng(5)
    guard, noise = Guard(rest), rest.sensors["position"].noise
    for reading in rest["xmid"] + noise * random.standard_normal(20_000):
        guard.watch({"position": float(reading)})
    assert guard.tripped is None


TRIPS = {
    "stroke": ([{"position": 0.2401}], "position beyond +-240 mm of mid stroke"),
    "other end": ([{"position": -0.2401}], "position beyond +-240 mm of mid stroke"),
    "speed": ([{"position": 0.0}, {"position": 0.0054}], "speed above 5 m/s"),
    "speed back": ([{"position": 0.0}, {"position": -0.0054}], "speed above 5 m/s"),
    "force": ([{"position": 0.0, "force": 90.1e3}], "force above 90 kN"),
    "compression": ([{"position": 0.0, "force": -90.1e3}], "force above 90 kN"),
    "no position": ([{"force": 0.0}], "the position signal is lost"),
    "nothing": ([{}], "the position signal is lost"),
    "not a number": ([{"position": np.nan}], "the position signal is not finite"),
    "infinite": ([{"position": 0.0, "pa": np.inf}], "the pa signal is not finite"),
    "force not a number": ([{"position": 0.0, "force": np.nan}], "the force signal is not finite"),
}


@pytest.mark.parametrize("what", TRIPS)
def test_the_guard_trips_and_stays_tripped(guard, what):
    """The command then goes to 0 at the allowed rate, whatever is measured or demanded."""
    measurements, reason = TRIPS[what]
    guard.reset(0.7)
    for measured in measurements:
        assert guard.tripped is None
        guard.watch(measured)
    assert guard.tripped == reason
    commands = []
    for _ in range(8):
        commands.append(guard.limit(1.0))
        guard.watch(QUIET)
    assert commands == pytest.approx([0.5, 0.3, 0.1, 0, 0, 0, 0, 0], abs=1e-12)
    assert guard.tripped == reason
    guard.reset(0.2)
    assert guard.tripped is None
    assert guard.limit(0.3) == pytest.approx(0.3)


def test_a_signal_that_was_there_and_is_gone_trips(guard):
    guard.watch({"position": 0.0, "force": 0.0})
    guard.watch({"position": 0.0})
    assert guard.tripped == "the force signal is lost"


@pytest.mark.parametrize("demanded", [np.nan, np.inf, -np.inf])
def test_a_command_that_is_not_finite_trips(guard, demanded):
    guard.reset(0.5)
    assert guard.limit(demanded) == pytest.approx(0.3)
    assert guard.tripped == "the controller's command is not finite"


def test_the_stroke_is_about_mid_stroke(rig):
    guard = Guard(rig.with_values(xmid=1.0))
    guard.watch({"position": 1.2})
    assert guard.tripped is None
    guard.reset(0.0)
    guard.watch({"position": 0.7})
    assert guard.tripped is not None


def test_a_reset_forgets_the_last_position(guard):
    guard.watch({"position": -0.2})
    guard.reset(0.0)
    guard.watch({"position": 0.2})
    assert guard.tripped is None
