"""Motions from rest to rest: within their limits, one of them always met, exact at both ends."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from workbench.loop.trajectories import jerk_limited, time_optimal

TIGHT = 1e-9
sizes = st.floats(1e-4, 1.0) | st.floats(-1.0, -1e-4)
speeds, accelerations, jerks = st.floats(0.01, 5.0), st.floats(0.1, 100.0), st.floats(1.0, 1e5)


def sampled(trajectory):
    """Instants inside the motion, clear of the joints, and the four signals there."""
    ends = np.cumsum([piece.duration for piece in trajectory.pieces])
    t = np.linspace(0, trajectory.duration, 2002)[1:-1]
    t = t[np.abs(t[:, None] - ends).min(axis=1) > 1e-12]
    return t, trajectory.at(t)


def at_rest_at_both_ends(trajectory, size):
    before, after = -1.0, trajectory.duration + 1e-12
    for signal, end in zip(trajectory.at(np.array([before, after])), (size, 0.0, 0.0, 0.0), strict=True):
        assert signal.tolist() == [0.0, end]
    last = trajectory.pieces[-1]
    x, v, *_ = (float(signal[0]) for signal in last.at(np.array([last.duration])))
    assert x == pytest.approx(abs(size), rel=TIGHT)
    assert v == pytest.approx(0.0, abs=TIGHT)


@given(size=sizes, speed=speeds, acceleration=accelerations, jerk=jerks)
def test_a_jerk_limited_motion_keeps_its_limits_and_always_meets_one(size, speed, acceleration, jerk):
    trajectory = jerk_limited(size, speed, acceleration, jerk)
    at_rest_at_both_ends(trajectory, size)
    _, (_, v, a, j) = sampled(trajectory)
    for signal, limit in ((v, speed), (a, acceleration), (j, jerk)):
        assert np.abs(signal).max() <= limit * (1 + TIGHT) + TIGHT
    met = [np.abs(signal) >= limit * (1 - TIGHT) for signal, limit in ((v, speed), (a, acceleration), (j, jerk))]
    assert np.any(met, axis=0).all()


@given(size=sizes, speed=speeds, acceleration=accelerations, jerk=jerks)
@settings(max_examples=20)
def test_jerk_sums_up_to_acceleration_and_that_to_speed_and_position(size, speed, acceleration, jerk):
    t = np.linspace(0, jerk_limited(size, speed, acceleration, jerk).duration, 20001)
    x, v, a, j = jerk_limited(size, speed, acceleration, jerk).at(t)
    for below, above, limit in ((j, a, jerk), (a, v, acceleration), (v, x, speed)):
        summed = np.cumsum((below[1:] + below[:-1]) / 2 * np.diff(t))
        assert summed == pytest.approx(above[1:], abs=8 * limit * t[1])  # it jumps at eight joints


def test_the_seven_pieces_of_a_long_motion():
    trajectory = jerk_limited(1.0, 1.0, 10.0, 100.0)
    assert [piece.duration for piece in trajectory.pieces] == pytest.approx([0.1, 0.0, 0.1, 0.8, 0.1, 0.0, 0.1])
    assert jerk_limited(0.01, 5.0, 100.0, 2e3).duration == pytest.approx(np.cbrt(32 * 0.01 / 2e3))


@given(
    size=sizes,
    share=st.floats(0.1, 0.99),
    acceleration=accelerations,
    a0=st.floats(1.0, 200.0),
    v0=st.floats(0.1, 10.0),
)
def test_a_time_optimal_motion_keeps_its_limits_and_always_meets_one(size, share, acceleration, a0, v0):
    speed = share * v0
    trajectory = time_optimal(size, speed, acceleration, a0, v0)
    at_rest_at_both_ends(trajectory, size)
    _, (_, v, a, _) = sampled(trajectory)
    v, a = np.sign(size) * v, np.sign(size) * a
    driving = np.minimum(a0 * (1 - (v / v0) ** 2), acceleration)
    braking = -min(a0, acceleration)
    assert np.all(a <= driving + TIGHT * a0)
    assert np.all(a >= braking * (1 + TIGHT))
    assert np.all((v >= -TIGHT) & (v <= speed * (1 + TIGHT)))
    met = (a >= driving * (1 - TIGHT) - TIGHT) | (a <= braking * (1 - TIGHT)) | (v >= speed * (1 - TIGHT))
    assert met.all()


def test_a_time_optimal_motion_without_a_valve_in_the_way_is_bang_bang():
    """10 mm at 100 m/s2: half the way at each."""
    assert time_optimal(0.01, 5.0, 100.0, 1e6, 1e3).duration == pytest.approx(2 * np.sqrt(0.01 / 100), rel=1e-6)


def test_a_time_optimal_motion_is_what_a_simulation_of_the_valve_gives():
    trajectory = time_optimal(0.3, 6.0, np.inf, 80.0, 7.0)
    t = np.linspace(0, trajectory.duration, 200001)
    x, v, a, _ = trajectory.at(t)
    top = int(np.argmax(v))
    stepped = np.zeros(top + 1)
    for i in range(top):  # Heun
        slope = 80.0 * (1 - (stepped[i] / 7.0) ** 2)
        ahead = stepped[i] + slope * t[1]
        stepped[i + 1] = stepped[i] + t[1] / 2 * (slope + 80.0 * (1 - (ahead / 7.0) ** 2))
    assert v[: top + 1] == pytest.approx(stepped, abs=1e-6)
    assert np.trapezoid(v, t) == pytest.approx(0.3, rel=1e-6)
    assert a[-2] == pytest.approx(-80.0)
    assert x[-2] == pytest.approx(0.3, rel=1e-6)
