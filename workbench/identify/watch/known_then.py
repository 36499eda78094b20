"""What was known of each session when it was the newest: by itself and those before it, so that later ones change
nothing of it."""

import numpy as np

from ...plant.effects import numbers_of
from ...rigs.rig import Rig
from ..fit.solver import UNSEEN
from .history import EARLY, History, marginal, wander
from .smoothed import smoothed

NORMAL = 1.96  # standard deviations in half of a 95 % interval


def intervals(rig: Rig, of: History, moves: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    """Value, low and high (95 %) [3, T, n] SI of every axis, of moves and standard deviations [T, n]; NaN where a
    session does not tell it.

    Told is what is known to less than UNSEEN of its declared range; of an effect or a sensor, of how far it may be to
    either side. What wears may leave its range, but not past 0; what is not sure to have left it has its ends inside.
    """
    own = {n.name: (n.low, n.high) for n in numbers_of(rig).values() if n.low is not None and n.high is not None}
    low, high = np.array([own.get(axis.name, (-np.inf, np.inf)) for axis in of.axes], dtype=float).reshape(-1, 2).T
    scale, reach = (np.array([getattr(axis, part) for axis in of.axes]) for part in ("scale", "reach"))
    value = np.array([axis.value for axis in of.axes]) + scale * moves
    value, half = np.maximum(value, np.where(low >= 0, 0.0, -np.inf)), NORMAL * scale * deviations
    ends = np.maximum(value - half, np.minimum(low, value)), np.minimum(value + half, np.maximum(high, value))
    told = 2 * half < UNSEEN * np.where(np.isfinite(high), high - low, 2 * reach * scale)
    return np.where(told, np.array([value, *ends]), np.nan)


def known_then(of: History) -> tuple[np.ndarray, np.ndarray]:
    """Moves [T, n] of every session and their standard deviations, each as `smoothed` has the last one of a history
    that ends there.

    How the rig wanders is known after EARLY sessions; from there on, sums over the sessions go on by one each.
    """
    count, n = of.vector.shape
    moves, deviations = np.empty((2, count, n))
    for t in range(min(count, EARLY)):
        own, spread = smoothed(of.until(t + 1))
        moves[t], deviations[t] = own[-1], spread[-1]
    if count <= EARLY:
        return moves, deviations
    variance = wander(of)
    rest = marginal(of, variance)
    normal, vector = np.diag(rest.reach**-2.0), np.zeros(rest.reach.size)
    for t in range(count):
        design = rest.design[t]
        normal = normal + design.T @ rest.matrix[t] @ design
        vector = vector + design.T @ rest.vector[t]
        if t < EARLY:
            continue
        inverse = np.linalg.inv(normal)
        mean = design @ (inverse @ vector)
        known = np.linalg.inv(of.matrix[t] + np.diag(1.0 / variance))
        reach = known @ (design / variance[:, None])
        moves[t] = mean + known @ (of.vector[t] - of.matrix[t] @ mean)
        deviations[t] = np.sqrt(np.diag(known) + np.einsum("np,np->n", reach @ inverse, reach))
    return moves, deviations
