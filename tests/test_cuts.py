"""A block of the plant, cut at what is measured: what recorded speeds, as noisy as they are, say of it."""

import numpy as np
import pytest

from workbench.identify.trace.cuts import _Block


class Block(_Block):
    """One that leaves `chi2`, with errors of a deviation, and `measured` with recorded speeds."""

    def __init__(self, chi2, deviation=1.0, measured=None):
        self._left, self._deviation, self._beside, self._p = chi2, deviation, measured, np.zeros(1)

    def _chi2(self, p):
        return self._left

    def _of_its_own(self, free):
        return self._p

    def _sizes(self):
        return np.array([1.0 / self._deviation])

    def _with_recorded_speed(self):
        return self._beside


@pytest.mark.parametrize(
    ("left", "noisier", "with_speeds", "says"),
    [
        (1.1, 4.0, 1.0, 1.1),  # nothing is missing
        (5.0, 1.2, 1.1, 1.1),  # as good as the model's speeds, and nothing is left
        (5.0, 1.2, 3.0, 5.0),
        (40.0, 1.6, 2.5, None),  # noise alone would leave 40/1.6^2, so that the model's speeds were off
        (40.0, 1.6, 6.0, 40.0),
        (5.0, 3.8, 1.2, 5.0),  # so noisy that anything is hidden
    ],
)
def test_recorded_speeds_clear_a_block_only_beyond_what_their_noise_would_hide(left, noisier, with_speeds, says):
    assert Block(left, 1.0, Block(with_speeds, noisier)).own_chi2(()) == says


def test_a_block_without_recorded_speeds_is_what_it_leaves():
    assert Block(5.0).own_chi2(()) == 5.0
