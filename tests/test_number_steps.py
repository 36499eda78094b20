"""Steps of numbers inside their ranges: the least of a quadratic, also where rounding is all that a direction has."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.identify.fit.normal_equations import least_step

ENDS = -np.ones(3), np.ones(3)


@given(st.integers(0, 10_000))
def test_no_step_inside_the_ranges_leaves_less(seed):
    random = np.random.default_rng(seed)
    slopes, gradient, x = random.normal(size=(5, 3)), 5 * random.normal(size=3), random.uniform(-1, 1, 3)
    matrix = slopes.T @ slopes + 0.1 * np.eye(3)
    step = least_step(matrix, gradient, x, ENDS)
    assert np.all(np.abs(x + step) <= 1 + 1e-9)
    others = random.uniform(-1, 1, (200, 3)) - x
    left = [0.5 * d @ matrix @ d + gradient @ d for d in (step, *others)]
    assert left[0] <= min(left[1:]) + 1e-9


def test_what_rounding_alone_is_left_of_does_not_move():
    lost, told = np.array([1.0, -1.0, 0.0]), np.array([1.0, 1.0, 0.0])
    matrix = np.array([[1.0, 1.0 + 1e-9, 0.0], [1.0 + 1e-9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(matrix)
    step = least_step(matrix, -0.3 * told - 1e-7 * lost, np.zeros(3), ENDS)
    assert step @ lost == pytest.approx(0, abs=1e-6)
    assert step @ told == pytest.approx(0.3, rel=1e-6)
