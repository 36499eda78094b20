"""The filter and smoother by which a trace finds an equation: against dense Gaussian algebra, and over long runs."""

import numpy as np
import pytest

from workbench.identify.trace.localise import LinearTimeVaryingModel, likelihood, smoothed

PERIOD, TIME = 1e-3, 4e-3


def random_model(seed: int, rows: int = 12, n: int = 3, m: int = 2, s: int = 2) -> LinearTimeVaryingModel:
    draw = np.random.default_rng(seed).standard_normal
    a, b, c, d = (draw((2, rows, *size)) for size in ((n, n), (n, m), (s, n), (s, m)))
    return LinearTimeVaryingModel(3 * draw((2, rows, s)), 0.5 * a, b, c, d)


def dense(model: LinearTimeVaryingModel, w: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """How the errors [rows * s] of a window follow from the first state and all disturbances, and their covariance."""
    (rows, s), n, m = model.e.shape[1:], model.a.shape[-1], model.b.shape[-1]
    state = np.hstack((np.eye(n), np.zeros((n, rows * m))))
    lines = []
    for k in range(rows):
        own = np.zeros((m, n + rows * m))
        own[:, n + k * m : n + (k + 1) * m] = np.eye(m)
        lines.append(model.c[w, k] @ state + model.d[w, k] @ own)
        state = model.a[w, k] @ state + model.b[w, k] @ own
    decay = np.exp(-PERIOD / TIME)
    gap = np.abs(np.subtract.outer(np.arange(rows), np.arange(rows)))
    covariance = np.eye(n + rows * m)
    covariance[n:, n:] = size**2 * np.kron(decay**gap, np.eye(m))
    return np.reshape(lines, (rows * s, -1)), covariance


@pytest.mark.parametrize("size", [0.1, 3.0])
def test_the_likelihood_is_that_of_the_errors_as_one_gaussian(size):
    model = random_model(1)
    for w in range(2):
        lines, covariance = dense(model, w, size)
        whole, e = lines @ covariance @ lines.T + np.eye(len(lines)), model.e[w].ravel()
        expected = -0.5 * (e @ np.linalg.solve(whole, e) + np.linalg.slogdet(whole)[1])
        assert likelihood(model, np.array([size]), PERIOD, TIME)[0, w] == pytest.approx(expected, rel=1e-9)


def test_what_is_smoothed_is_the_conditional_mean_of_the_disturbance():
    model, size = random_model(2), np.array([0.7, 2.0])
    found = smoothed(model, size, PERIOD, TIME)
    for w in range(2):
        lines, covariance = dense(model, w, size[w])
        whole = lines @ covariance @ lines.T + np.eye(len(lines))
        mean = covariance @ lines.T @ np.linalg.solve(whole, model.e[w].ravel())
        np.testing.assert_allclose(-found[w].ravel(), mean[3:], rtol=1e-7, atol=1e-9)


def test_a_run_along_which_the_model_grows_is_still_filtered():
    """States that grow a millionfold between two rows that tell of them, as where dry friction lets go."""
    rows = 400
    a = np.tile(np.diag([0.9, 0.9]), (1, rows, 1, 1))
    a[0, ::50] = [[1e6, 1e5], [1e6, -1e5]]
    c = np.tile([[1.0, 1.0], [1.0, 1.0 + 1e-12]], (1, rows, 1, 1))
    b, d = np.ones((1, rows, 2, 1)), np.zeros((1, rows, 2, 1))
    model = LinearTimeVaryingModel(np.ones((1, rows, 2)), a, b, c, d)
    assert np.isfinite(likelihood(model, np.array([1.0, 1e6]), PERIOD, TIME)).all()
    assert np.isfinite(smoothed(model, np.array([1e6]), PERIOD, TIME)).all()
