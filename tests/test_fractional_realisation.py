"""State spaces of fractional systems: over their band, with the error that they say."""

import control
import numpy as np
import pytest
from fractional_plants import PLANTS, PODLUBNY, s


@pytest.mark.parametrize("plant", [PODLUBNY, *PLANTS[2:], 2 / (s**0.5 * (s + 3)), (1 + s**0.5) / (2 + s**0.5)])
def test_a_realisation_is_the_system_over_its_band_and_says_how_far_it_is_off(plant):
    f = np.geomspace(0.01, 10, 77)
    for space, gain, phase in ((plant.oustaloup(0.01, 10), 0.5, 5.0), (plant.least_squares(0.01, 10, 8), 0.03, 0.3)):
        assert space.gain_error < gain
        assert space.phase_error < phase
        ratio = space.system(2j * np.pi * f) / plant.response(f)
        assert 20 * np.abs(np.log10(np.abs(ratio))).max() < 1.1 * space.gain_error
        assert np.real(space.system.poles()).max() < 1e-9
        assert f"within {space.gain_error:.2g} dB" in repr(space)
        as_control = space.to_control()
        assert as_control(2j) == pytest.approx(space.system(2j))
        assert [panel.y_label for panel in space.figure().panels][2:] == ["gain error [dB]", "phase error [deg]"]


def test_oustaloups_realisation_keeps_the_gain_at_rest_and_the_step():
    space = PODLUBNY.oustaloup(1e-3, 100).system
    assert space(0.0) == pytest.approx(1.0)
    t = np.linspace(0, 20, 200)
    found = control.step_response(space.to_control(), t).outputs
    assert found == pytest.approx(PODLUBNY.step(t), abs=0.02)


@pytest.mark.parametrize("direct", [True, False])
def test_whole_orders_are_realised_exactly(direct):
    g = ((s**2 if direct else 1) + 0.3) / (s**2 + 0.2 * s + 1)
    for space in (g.oustaloup(0.01, 1), g.least_squares(0.01, 1, 2)):
        assert len(space.system.A) == 2
        assert space.gain_error < 1e-6


def test_more_states_are_nearer():
    errors = [PODLUBNY.least_squares(0.01, 10, states).gain_error for states in (3, 5, 7, 9)]
    assert errors == sorted(errors, reverse=True)
