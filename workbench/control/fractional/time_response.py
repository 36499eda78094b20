"""Response of a fractional system over time: the inverse Laplace transform on a contour of its own at each time."""

from collections.abc import Callable

import numpy as np

Transform = Callable[[np.ndarray], np.ndarray]

_DIGITS = 36.0  # -ln of the accuracy aimed at, 2e-16
_REACH = np.geomspace(1.5, 8.0, 40)  # mu t that are tried: rounding grows as exp(mu t)
_CLEAREST = 0.6  # a pole or the cut no nearer than that to a contour needs no finer step
_CIRCLE = 64
_CLUSTER = 0.02  # poles so near, over their size, share a circle
_REAL = 1e-9  # of a size: what is no imaginary part
_TIMES_AT_ONCE = 256


def inverse_laplace(transform: Transform, poles: np.ndarray, t: np.ndarray) -> np.ndarray:
    """f [n] at t [n] > 0 in s of F(s), whose singularities are `poles` [k], all with |arg s| < 0.9 pi, and the cut.

    f(t) = sum of the residues outside + 1/(2 pi j) integral of exp(s t) F(s) ds along s = mu (1 + j u)^2, by the
    trapezoidal rule, whose error falls as exp(-2 pi c/h), c the distance of the next singularity in the plane of u
    (Weideman and Trefethen, Mathematics of Computation 76, 2007). mu is the one, of forty, that keeps furthest from the
    poles (Garrappa, SIAM J. Numerical Analysis 53, 2015, chooses it for the Mittag-Leffler function).
    """
    f = np.zeros(len(t))
    for start in range(0, len(t), _TIMES_AT_ONCE):
        part = slice(start, start + _TIMES_AT_ONCE)
        f[part] = _on_contours(transform, poles, t[part])
    return f


def _on_contours(transform: Transform, poles: np.ndarray, t: np.ndarray) -> np.ndarray:
    mu, clearance = _contours(poles, t)
    step = 2 * np.pi * clearance / _DIGITS
    last = np.sqrt(1 + _DIGITS / (mu * t))
    count = int(np.ceil(np.max(last / step)))
    u = step[:, None] * (np.arange(count) + 0.5)
    line = 1 + 1j * u
    s = mu[:, None] * line**2
    values = np.where(u <= last[:, None] + step[:, None], np.exp(s * t[:, None]) * transform(s) * line, 0)
    integral = (2 * mu * step / np.pi) * np.real(values.sum(axis=1))
    return integral + _residues(transform, poles, mu, t)


def _contours(poles: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """mu [n] [rad/s] of the contours and their distance [n] to the next singularity, in u."""
    mu = _REACH[:, None] / t
    if not len(poles):
        return mu[np.argmin(np.abs(_REACH - 4))], np.full(len(t), _CLEAREST)
    root = np.sqrt(poles.astype(complex))
    distance = np.abs(np.real(root) / np.sqrt(mu)[..., None] - 1).min(axis=2)
    best = np.argmax(np.minimum(distance, _CLEAREST), axis=0)
    at = best, np.arange(len(t))
    return mu[at], np.minimum(distance[at], _CLEAREST)


def _residues(transform: Transform, poles: np.ndarray, mu: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Sum of the residues of exp(s t) F(s) at the poles right of the contours, [n]."""
    total = np.zeros(len(t))
    for cluster in clusters(poles):
        centre = cluster.mean()
        real = abs(centre.imag) < _REAL * abs(centre)
        outside = np.sqrt(centre).real > np.sqrt(mu)
        if not outside.any() or (centre.imag < 0 and not real):
            continue
        radius = _radius(cluster, poles, t[outside])
        turn = np.exp(2j * np.pi * (np.arange(_CIRCLE) + 0.5) / _CIRCLE)
        s = centre + radius[:, None] * turn
        residue = radius * np.mean(np.exp(s * t[outside, None]) * transform(s) * turn, axis=1)
        total[outside] += residue.real * (1 if real else 2)
    return total


def _radius(cluster: np.ndarray, poles: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Radius [n] of a circle about a cluster: 1/t, but outside of all of its poles and away from the others."""
    centre = cluster.mean()
    others = poles[~np.isin(poles, cluster)]
    near = np.min(np.abs(np.append(others, 0.0) - centre))
    return np.clip(1 / t, max(3 * np.abs(cluster - centre).max(), 1e-6 * near), near / 3)


def clusters(poles: np.ndarray) -> list[np.ndarray]:
    """Poles grouped with those that are nearer than a small part of their size."""
    groups: list[np.ndarray] = []
    rest = poles
    while len(rest):
        near = np.abs(rest - rest[0]) < _CLUSTER * np.abs(rest[0])
        while True:
            wider = (np.abs(rest[:, None] - rest[near]) < _CLUSTER * np.abs(rest[:, None])).any(axis=1)
            if wider.sum() == near.sum():
                break
            near = wider
        groups.append(rest[near])
        rest = rest[~near]
    return groups
