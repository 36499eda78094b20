"""Curves bend as far as what is left out asks for: neither with the noise, nor less than the recordings show."""

import numpy as np
import pytest

from workbench.identify.fit.determined import FreeParameter
from workbench.identify.fit.prior import STIFFEST, prior_of
from workbench.identify.fit.rotation import Parts
from workbench.plant import build
from workbench.plant.effects.curves import bends
from workbench.plant.effects.learned_pieces import find_learned
from workbench.rigs.rig_file import load_rig

KNOTS = np.linspace(-1, 1, 15)
TYPICAL = 0.2  # of a slope
NAMES = [f"c{k}" for k in range(len(KNOTS))]
FREE = tuple(FreeParameter(name, 0.0, -5.0, 5.0, TYPICAL, "") for name in NAMES)
ROWS = tuple({name: weight / TYPICAL for name, weight in row.items()} for row in bends(NAMES, order=1))
FINE = np.linspace(-1, 1, 400)


def basis(u: np.ndarray) -> np.ndarray:
    """Integrals from -1 of the hats about the knots [..., knots], which a curve of slopes is made of."""
    hats = np.array([np.interp(FINE, KNOTS, row) for row in np.eye(len(KNOTS))])
    integrals = np.cumsum(hats, axis=1) * (FINE[1] - FINE[0])
    return np.moveaxis(np.array([np.interp(u, FINE, row) for row in integrals]), 0, -1)


def optimum(slopes: np.ndarray, measured: np.ndarray, stiffness: float) -> np.ndarray:
    prior = prior_of(FREE, ROWS).at(stiffness)
    flat = slopes.reshape(-1, len(KNOTS))
    return np.linalg.solve(flat.T @ flat + prior.matrix, flat.T @ measured.ravel())


def chosen(slopes: np.ndarray, measured: np.ndarray) -> tuple[np.ndarray, float]:
    """The coefficients, as distances, of the stiffness that a fit comes to, and that one."""
    stiffness, tried = STIFFEST, set()
    while stiffness not in tried:
        tried.add(stiffness)
        x = optimum(slopes, measured, stiffness)
        left = slopes @ x - measured
        gradients = np.einsum("wrk,wr->wk", slopes, left)
        parts = Parts(np.sum(left**2, 1), np.swapaxes(slopes, 1, 2) @ slopes, gradients, np.arange(len(left)) % 4)
        stiffness = parts.best_stiffness(prior_of(FREE, ROWS).at(stiffness), x)
    return x, stiffness


def recorded(curve, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Slopes [windows, rows, k] and what was measured [windows, rows] of a curve, over its noise."""
    random = np.random.default_rng(seed)
    u = random.uniform(-1, 1, (16, 25))
    return TYPICAL * basis(u) / noise, (curve(u) + noise * random.standard_normal(u.shape)) / noise


def smooth(u: np.ndarray) -> np.ndarray:
    return 0.1 * (1 - np.cos(np.pi * (u + 1)))


def knee(u: np.ndarray) -> np.ndarray:
    return np.maximum(u - KNOTS[9], 0.0)


def error(curve, x: np.ndarray) -> float:
    """Root mean square over the range."""
    return float(np.sqrt(np.mean((TYPICAL * basis(FINE) @ x - curve(FINE)) ** 2)))


@pytest.mark.parametrize("seed", range(5))
def test_a_smooth_curve_is_recovered_better_than_without(seed):
    slopes, measured = recorded(smooth, 0.1, seed)
    x, stiffness = chosen(slopes, measured)
    assert stiffness > 1
    assert error(smooth, x) < 0.8 * error(smooth, optimum(slopes, measured, 0.0))


@pytest.mark.parametrize("seed", range(5))
def test_a_knee_that_the_recordings_show_stays(seed):
    slopes, measured = recorded(knee, 0.01, seed)
    x, _ = chosen(slopes, measured)
    assert error(knee, x) < 0.01
    assert error(knee, optimum(slopes, measured, STIFFEST)) > 0.05


@pytest.mark.parametrize(
    ("name", "formula", "count"),
    [
        ("learned.opening", "lands; spline 9 in opening", 9),  # eight between slopes, and their mean
        ("learned.friction", "spline 5 in |velocity|", 2),  # of four heights
        ("learned.modulus", "oil; spline 5 in pressure", 2),  # of three steps
    ],
)
def test_a_plant_says_where_its_curves_are_straight(name, formula, count):
    plant = build(load_rig("festo-tp511"), also=(find_learned(name, formula),))
    assert len(plant.bends) == count
    assert all(set(bend) <= set(plant.parameters) for bend in plant.bends)


def test_a_height_that_stays_at_zero_takes_part():
    assert bends(["a", None, "b"], order=2) == ({"a": 1.0, "b": 1.0},)
    assert bends(["a", "b"], order=2) == ()
