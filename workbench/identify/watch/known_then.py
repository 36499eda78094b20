"""What was known of each session when it was the newest: by itself and those before it, so that later ones change
nothing of it."""

import numpy as np

from .history import EARLY, History, marginal, wander
from .smoothed import smoothed


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
