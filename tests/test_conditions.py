"""What loops are judged under: computing delay, sensor noise and resolution, and the band that noise leaves."""

from dataclasses import replace

import numpy as np
import pytest

import workbench as wb
from controllers import P, PressureFeedback
from workbench.base.errors import InputError
from workbench.loop.rig_variations import Conditions
from workbench.rigs.rig import COMPUTING_DELAY
from workbench.rigs.rig_file import load_rig, rig_text, save_rig

LAW = P(gain=3.7) + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz")


@pytest.fixture(scope="module")
def loop():
    return wb.ClosedLoop("jack-10t", LAW)


def test_a_loop_has_the_rig_s_delay_the_controller_s_own_or_none_where_it_is_ideal(rig):
    judged, ideal = Conditions(), Conditions(ideal=True)
    slow, free = replace(LAW, computing_delay=1e-3), replace(LAW, computing_delay=0.0)
    assert judged.delay(LAW, rig) == rig.computing_delay.value == 0.3e-3
    assert judged.delay(slow, rig) == 1e-3
    assert judged.delay(free, rig) == ideal.delay(slow, rig) == 0.0
    ms = [wb.ClosedLoop(rig, spec).margins().ms for spec in (free, LAW, slow)]
    assert ms[0] == wb.ClosedLoop(rig, slow, ideal=True).margins().ms
    assert ms[0] < ms[1] < ms[2]


def test_noise_is_drawn_from_the_seed_and_no_loop_that_is_calm_without_it_hunts(loop):
    first, again, other = (loop.step("10 mm", seconds="1 s", seed=seed) for seed in (0, 0, 1))
    assert np.array_equal(first["position"], again["position"])
    assert not np.array_equal(first["position"], other["position"])
    assert first.metrics["iae"] != other.metrics["iae"]
    assert first.metrics["residual_oscillation"] == other.metrics["residual_oscillation"] < 1e-5
    assert np.ptp(first["position"][-300:]) > 1e-3 * 1e-3  # what would pass for hunting


def test_an_ideal_loop_ignores_the_seed(rig):
    ideal = wb.ClosedLoop(rig, LAW, ideal=True)
    one, two = (ideal.step("1 mm", seconds="0.1 s", seed=seed) for seed in (0, 1))
    assert np.array_equal(one["position"], two["position"])


def test_a_band_is_no_narrower_than_three_standard_deviations_of_the_sensor(loop):
    assert loop.step("1 mm", seconds="0.5 s").metrics["band"] == pytest.approx(120e-6)
    assert loop.step("100 mm", seconds="0.5 s").metrics["band"] == pytest.approx(2e-3)


def test_a_load_is_judged_by_its_peak_and_how_long_the_jack_is_off(rig):
    """P lacks what the leakage of the loaded jack takes; the peak is above what the oil gives by itself, F/k."""
    metrics = wb.ClosedLoop(rig, LAW).follow("position-load-20kn").metrics
    k = 2 * rig["beta"] * rig["Aj"] ** 2 / (rig["V0"] + rig["Aj"] * rig["S"] / 2)
    assert 20e3 / k < metrics["peak_deviation"] < 5e-3
    assert metrics["settling_s"] is None
    assert metrics["steady_state_error"] > metrics["band"]
    for key in ("overshoot_percent", "rise_s"):
        assert metrics[key] is None
    assert metrics["residual_oscillation"] < 1e-3


def test_a_scenario_that_starts_at_an_end_of_the_stroke_has_the_margins_there(loop):
    middle, end = loop.step("10 mm"), loop.follow("position-10mm-at+90")
    assert end["position"][0] == pytest.approx(0.216)
    assert end["position"][-1] == pytest.approx(0.206, abs=1e-4)
    assert end.metrics["ms"] > middle.metrics["ms"]
    there = loop.step("-10 mm", start="216 mm")
    assert there.metrics["ms"] == end.metrics["ms"]


def test_a_rig_declares_its_computing_delay(tmp_path, rig):
    assert load_rig("jack-10t").computing_delay == COMPUTING_DELAY
    own = replace(rig, computing_delay=replace(COMPUTING_DELAY, value=1e-3, source="measured"))
    save_rig(own, tmp_path / "own.toml")
    assert load_rig(tmp_path / "own.toml").computing_delay == own.computing_delay
    text = rig_text(own)
    (tmp_path / "bad.toml").write_text(text.replace("\ncomputing_delay = ", "\ncomputing_delays = "))
    with pytest.raises(InputError, match='unknown key; did you mean "computing_delay"'):
        load_rig(tmp_path / "bad.toml")
