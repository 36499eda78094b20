"""References of one's own: sampled without aliasing, and slowed to what a rig can follow."""

import numpy as np
import pytest

from workbench.loop.capability import Capability
from workbench.loop.reach import sampled_record, slowed_record, too_fast

RIG = Capability(a0=90.0, v0=7.0, limit=5.0, mode=30.0)


def fast(f, rate=1e4, seconds=1.0, size=1e-3):
    t = np.arange(round(rate * seconds) + 1) / rate
    return t, size * np.sin(2 * np.pi * f * t)


@pytest.mark.parametrize("f", [501.0, 700.0, 1000.0, 1900.0, 4500.0])
@pytest.mark.parametrize("rate", [1e4, 1.3e4])
def test_a_sine_above_the_nyquist_frequency_leaves_nothing(f, rate):
    t, values = fast(f, rate)
    sampled = sampled_record(t, values, 1e-3)
    assert np.abs(sampled.values[30:-30]).max() < 1e-3 * 1e-3
    assert sampled.left_out > 0.98


@pytest.mark.parametrize("f", [1.0, 50.0, 300.0])
def test_a_sine_below_stays_what_it_is_and_in_phase(f):
    t, values = fast(f)
    sampled = sampled_record(t, values, 1e-3)
    assert sampled.t == pytest.approx(np.arange(1001) * 1e-3)
    assert sampled.values == pytest.approx(1e-3 * np.sin(2 * np.pi * f * sampled.t), abs=2e-6)
    assert sampled.left_out < 1e-6
    assert sampled.values[0] == pytest.approx(0.0, abs=1e-15)


def test_a_slower_record_keeps_its_points():
    t, values = np.array([1.0, 1.1, 1.3]), np.array([0.1, 0.101, 0.099])
    sampled = sampled_record(t, values, 1e-3)
    assert sampled.t == pytest.approx([0, 0.1, 0.3])
    assert sampled.values == pytest.approx([0, 1e-3, -1e-3])
    assert (sampled.left_out, sampled.slowed) == (0.0, 1.0)


def test_how_much_too_fast_a_sine_is():
    """20 mm at 20 Hz: 316 m/s2 at rest where the rig gives 90; slower by the root of that."""
    t, values = fast(20.0, 1e3, size=0.02)
    asked = 0.02 * (2 * np.pi * 20) ** 2
    assert too_fast(sampled_record(t, values, 1e-3), RIG) == pytest.approx(np.sqrt(asked / 90), rel=5e-3)
    assert too_fast(sampled_record(t, values / 1e3, 1e-3), RIG) < 0.1


def test_a_record_is_slowed_until_it_is_just_within():
    t, values = fast(20.0, 5e3, size=0.02)
    slow = slowed_record(t, values, 1e-3, RIG)
    assert slow.slowed == pytest.approx(1.87, abs=0.02)
    assert too_fast(slow, RIG) == pytest.approx(1.0, abs=1e-3)
    assert too_fast(slow, RIG) <= 1
    assert slow.t[-1] == pytest.approx(slow.slowed * t[-1], abs=1e-3)
