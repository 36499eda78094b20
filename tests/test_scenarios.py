"""The standard scenarios: what the reference and the specimen's far end do."""

import numpy as np
import pytest

from workbench.loop.scenarios import SCENARIOS, Scenario, scenario

T = np.arange(40001) * 1e-4
every = pytest.mark.parametrize("wanted", SCENARIOS.values(), ids=lambda wanted: wanted.name)


@every
def test_a_reference_begins_where_the_loop_stands_or_steps_and_ends_at_its_size(wanted):
    asked = wanted.reference(T)
    assert asked[0] == (wanted.size if wanted.is_step or wanted.travel else 0)
    assert np.abs(asked).max() == pytest.approx(abs(wanted.size), rel=1e-6)
    if wanted.arrives is not None:
        assert np.all(asked[wanted.arrives <= T] == wanted.size)
        assert wanted.arrives + 0.3 < wanted.duration  # there is something to settle in


@every
def test_a_far_end_moves_as_its_velocity_says_and_then_stands(wanted):
    moved = wanted.inputs(T)
    if not wanted.travel:
        assert "specimen_position" not in moved
        return
    way, speed = moved["specimen_position"], moved["specimen_velocity"]
    assert np.gradient(way, T) == pytest.approx(speed, abs=1e-3)
    assert speed.max() == pytest.approx(wanted.speed)
    assert way[-1] == pytest.approx(wanted.travel)
    assert np.all(speed[(T < 0.5) | (wanted.arrives + 1e-6 < T)] == 0)


def test_a_load_comes_when_it_is_said_and_stays():
    load = scenario("position-load-20kn", "here")
    pushed = load.inputs(T)["disturbance"]
    assert np.all(pushed[T < 0.5 - 1e-9] == 0)
    assert np.all(pushed[T >= 0.5 - 1e-9] == 20e3)
    assert load.arrives == 0.5
    assert np.all(load.reference(T) == 0)


def test_a_step_at_an_end_of_the_stroke_goes_towards_the_middle_or_away_from_it():
    for side, sign in (("+90", 1), ("-90", -1)):
        inwards, outwards = (scenario(f"position-10mm-at{side}{end}", "here") for end in ("", "-out"))
        assert inwards.position(0.24) == outwards.position(0.24) == pytest.approx(sign * 0.216)
        assert (inwards.size, outwards.size) == (-sign * 10e-3, sign * 10e-3)


def test_a_waveform_is_linear_between_its_points_and_held_beyond():
    wave = Scenario("wave", "position", 2e-3, 1.0, waveform=((0.0, 0.1, 0.3), (0.0, 1e-3, -1e-3)))
    assert wave.arrives is None
    assert wave.reference(np.array([0.0, 0.05, 0.2, 0.3, 2.0])) == pytest.approx([0, 5e-4, 0, -1e-3, -1e-3])


def test_sines_of_all_frequencies_have_the_same_speed():
    for f in (1, 5, 30):
        sine = scenario(f"position-sine-{f}hz", "here")
        assert sine.arrives is None
        assert np.gradient(sine.reference(T), T).max() == pytest.approx(2 * np.pi * 0.01, rel=1e-3)


def test_a_ramp_goes_at_its_rate():
    ramp = scenario("position-ramp", "here")
    assert ramp.reference(np.array([0.0, 0.5, 1.0, 2.0])) == pytest.approx([0, 0.05, 0.1, 0.1])
    assert ramp.arrives == pytest.approx(1.0)
