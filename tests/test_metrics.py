"""Step metrics against analytic responses; a number that does not exist is None."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.loop import step_metrics as metrics

DT = 1e-4
T = np.arange(30001) * DT  # 3 s


def first_order(tau, before=0.0, target=1.0):
    return before + (target - before) * (1 - np.exp(-T / tau))


def second_order(w, zeta, before=0.0, target=1.0):
    wd = w * np.sqrt(1 - zeta**2)
    ring = np.exp(-zeta * w * T) * (np.cos(wd * T) + zeta * w / wd * np.sin(wd * T))
    return before + (target - before) * (1 - ring)


steps = st.tuples(st.floats(-2, 2), st.floats(0.01, 3), st.sampled_from([-1, 1]))


@given(tau=st.floats(0.02, 0.3), step=steps, band=st.sampled_from([0.01, 0.02, 0.05]))
def test_first_order(tau, step, band):
    before, size, sign = step
    target = before + sign * size
    y = first_order(tau, before, target)
    assert metrics.settling_time(T, y, target, band * size) == pytest.approx(-tau * np.log(band), abs=2 * DT)
    assert metrics.rise_time(T, y, before, target) == pytest.approx(tau * np.log(9), abs=2 * DT)
    assert metrics.overshoot(y, before, target) == pytest.approx(0.0, abs=1e-9)
    assert metrics.iae(T, y, target) == pytest.approx(size * tau * (1 - np.exp(-3 / tau)), rel=1e-3)
    mean_error = sign * size * tau / 0.3 * (np.exp(-2.7 / tau) - np.exp(-3.0 / tau))
    assert metrics.steady_state_error(T, y, target) == pytest.approx(mean_error, rel=1e-2, abs=1e-9)


@given(w=st.floats(15, 80), zeta=st.floats(0.2, 0.8), step=steps)
def test_second_order(w, zeta, step):
    before, size, sign = step
    target = before + sign * size
    y = second_order(w, zeta, before, target)
    peak = 100 * np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2))
    assert metrics.overshoot(y, before, target) == pytest.approx(peak, rel=1e-3)
    settled = metrics.settling_time(T, y, target, 0.02 * size)
    assert settled is not None
    outside = np.abs(y - target) > 0.02 * size
    assert not outside[np.round(settled / DT).astype(int) :].any()
    assert outside[round(settled / DT) - 1]
    assert settled <= -np.log(0.02 * np.sqrt(1 - zeta**2)) / (zeta * w) + DT  # the envelope
    assert metrics.steady_state_error(T, y, target) == pytest.approx(0, abs=1e-3 * size)


def test_rise_time_of_a_second_order_response():
    assert metrics.rise_time(T, second_order(10.0, 0.5), 0, 1) == pytest.approx(0.1639, abs=5e-4)


def test_time_counts_from_the_start_of_the_record():
    y = first_order(0.1)
    assert metrics.settling_time(T + 7, y, 1, 0.02) == pytest.approx(metrics.settling_time(T, y, 1, 0.02))
    assert metrics.rise_time(T + 7, y, 0, 1) == pytest.approx(metrics.rise_time(T, y, 0, 1))


def test_a_response_inside_the_band_from_the_start_settles_at_once():
    assert metrics.settling_time(T, np.full(T.size, 1.005), 1, 0.02) == 0.0


def test_what_does_not_settle_has_no_settling_time():
    for y in (first_order(2.0), 1 + 0.1 * np.sin(9 * T), np.zeros(T.size), 1 + 0.05 * (T > 2.9)):
        assert metrics.settling_time(T, y, 1, 0.02) is None
    late = np.where(T < 2.75, 0.0, 1.0)  # in the band only within the last 0.3 s: not seen to have settled
    assert metrics.settling_time(T, late, 1, 0.02) is None
    assert metrics.settling_time(T, np.where(T < 2.6, 0.0, 1.0), 1, 0.02) == pytest.approx(2.6, abs=2 * DT)


def test_what_does_not_rise_has_no_rise_time():
    assert metrics.rise_time(T, 0.89 * first_order(0.1), 0, 1) is None
    assert metrics.rise_time(T, -first_order(0.1), 0, 1) is None
    assert metrics.rise_time(T, 0.91 * first_order(0.1), 0, 1) is not None


def test_overshoot_of_a_step_downwards():
    y = np.array([1.0, 0.0, -0.2, 0.1])
    assert metrics.overshoot(y, 1.0, 0.0) == pytest.approx(20)
    assert metrics.overshoot(y, 1.0, -0.5) == 0.0


def test_a_peak_deviation_is_on_either_side():
    assert metrics.peak_deviation(np.array([1.0, 1.2, 0.7, 1.0]), 1.0) == pytest.approx(0.3)


def test_steady_state_error_has_the_sign_of_what_is_missing():
    assert metrics.steady_state_error(T, np.full(T.size, 0.9), 1.0) == pytest.approx(0.1)
    early = np.where(T < 2.69, 50.0, 0.9)
    assert metrics.steady_state_error(T, early, 1.0) == pytest.approx(0.1)


@given(a=st.floats(1e-4, 0.5), f=st.floats(30, 100), slope=st.floats(-1, 1), step=st.sampled_from([-2.0, 0.5, 1.0]))
def test_residual_oscillation_is_peak_to_peak_without_the_drift(a, f, slope, step):
    y = step + a * np.sin(2 * np.pi * f * T) + slope * T + 40 * (T < 2.69)  # what was before does not count
    assert metrics.residual_oscillation(T, y, step) == pytest.approx(2 * a / abs(step), rel=0.1)
    assert metrics.residual_oscillation(T, step + slope * T, step) == pytest.approx(0, abs=1e-9)


def test_saturated_and_cavitation_times_count_samples():
    t = np.arange(10) * 2e-3
    demanded = np.array([0.0, 2, 2, 2, 0.5, 0.1, 0, 0, np.nan, 0])
    realised = np.array([0.0, 1, 1, 1, 0.5, 0.1, 0, 1e-12, 0, 0])
    assert metrics.saturated_time(t, demanded, realised) == pytest.approx(4 * 2e-3)
    assert metrics.cavitation_time(t, np.array([1e5, -1, -1e5, 0, 1, 1, 1, -2, 1, 1])) == pytest.approx(3 * 2e-3)


def test_a_record_shorter_than_the_rest_it_must_show_does_not_settle():
    short = T < 0.2
    assert metrics.settling_time(T[short], first_order(0.01)[short], 1, 0.02) is None
