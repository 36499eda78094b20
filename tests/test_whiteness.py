"""Spectrum and autocorrelation of a residual against noises whose answers are known."""

import numpy as np
import pytest
from scipy.signal import lfilter

from workbench.identify.data.whiteness import whiteness

PERIOD = 1e-3


def test_white_noise_has_a_flat_spectrum_and_stays_in_its_band():
    errors = [2.0 * np.random.default_rng(seed).standard_normal(6000) for seed in range(4)]
    found = whiteness(errors, PERIOD, kappa=1.0)
    assert np.median(found.density[1:-1]) == pytest.approx(4.0 * 2 * PERIOD, rel=0.05)
    inside = np.abs(found.autocorrelation[1:]) < found.band
    assert 0.9 < inside.mean() <= 1


def test_coloured_noise_leaves_the_white_band_but_not_its_own():
    pole = 0.8
    kappa = (1 + pole) / (1 - pole)
    errors = [lfilter([1], [1, -pole], np.random.default_rng(seed).standard_normal(6000)) for seed in range(4)]
    white, coloured = whiteness(errors, PERIOD, 1.0), whiteness(errors, PERIOD, kappa)
    np.testing.assert_allclose(white.autocorrelation[:5], pole ** np.arange(5), atol=0.05)
    late = slice(40, None)  # where the noise's own memory has gone
    assert (np.abs(coloured.autocorrelation[late]) < coloured.band).mean() > 0.9
    assert (np.abs(white.autocorrelation[late]) < white.band).mean() < 0.9


def test_power_is_the_variance_and_missing_samples_do_not_lower_it():
    error = 3.0 * np.random.default_rng(9).standard_normal(8000)
    whole = whiteness([error], PERIOD, 1.0)
    assert whole.density.sum() * whole.f[1] == pytest.approx(9.0, rel=0.05)
    holed = np.where(np.random.default_rng(10).random(8000) < 0.3, np.nan, error)
    assert whiteness([holed], PERIOD, 1.0).density.sum() * whole.f[1] == pytest.approx(9.0, rel=0.08)
    assert np.abs(whiteness([holed], PERIOD, 1.0).autocorrelation[1:]).max() < 0.08
