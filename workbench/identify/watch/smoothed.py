"""Each number and effect over the sessions: a mean that goes with its changes, and the wander about it."""

from collections.abc import Sequence

import numpy as np

from .changes import Change
from .history import History, course, marginal, wander


def smoothed(of: History, found: Sequence[Change] = ()) -> tuple[np.ndarray, np.ndarray]:
    """Moves [T, n] of every session and their standard deviations: the mean with its changes, and the wander about it
    as far as the session's own recording tells it."""
    variance = wander(of) if len(of.days) > 2 else of.reach**2
    rest = marginal(of, variance)
    for each in found:
        rest = rest.with_column(each.axis, course(of.days, each.first, each.shape, each.end))
    inverse, _ = rest.solved()
    mean = rest.design @ (inverse @ np.einsum("tnp,tn->p", rest.design, rest.vector))
    known = np.linalg.inv(of.matrix + np.diag(1.0 / variance))
    about = np.einsum("tij,tj->ti", known, of.vector - np.einsum("tij,tj->ti", of.matrix, mean))
    # the mean's own uncertainty shows where a session says little
    reach = np.einsum("tij,jk->tik", known, np.diag(1.0 / variance)) @ rest.design
    spread = np.einsum("tnp,tnp->tn", reach @ inverse, reach)
    return mean + about, np.sqrt(np.einsum("tii->ti", known) + spread)
