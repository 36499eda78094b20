"""Sessions of one rig on common axes, how a healthy rig wanders between them, and what is left without that.

A healthy rig's numbers wander from session to session with variances W about a mean that may be another one after each
repair, and that goes with the oil's temperature.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .session_evidence import Axis, SessionEvidence

FEWEST = 8  # sessions that say how a healthy rig wanders; no alarm before
_BROAD = 10.0  # a change may be so large, in moves
LEAST_INFORMATION = 1.0  # of an axis in any session; below it a recording says nothing of it
NOISE_SHARE = 0.3  # of a session's own uncertainty: no axis is thought to be steadier
EARLY = 2 * FEWEST  # sessions that say how the rig wanders
_NORMAL_MEDIAN = 0.4549  # of the square of a normal variable
_PRIOR_SESSIONS, LEAST_SHARE = 8, 0.5  # sessions that the healthy wander counts as; the least that is left of it

Shape = Literal["jump", "drift"]


@dataclass(frozen=True, eq=False)
class History:
    """Sessions of one rig on common axes: days [T]; A [T, n, n] and c [T, n] of A q = c, q the moves [n]; the stretch
    between repairs that a session is in [T]; oil temperatures [K, T] where most sessions have one."""

    axes: tuple[Axis, ...]
    numbers: int
    days: np.ndarray
    matrix: np.ndarray
    vector: np.ndarray
    stretch: np.ndarray
    kelvin: np.ndarray | None

    def until(self, count: int) -> "History":
        """The first sessions alone."""
        return self.some(np.arange(min(count, len(self.days))))

    def some(self, sessions: np.ndarray) -> "History":
        """Some sessions [k] alone."""
        parts = (self.days[sessions], self.matrix[sessions], self.vector[sessions], self.stretch[sessions])
        return History(self.axes, self.numbers, *parts, None if self.kelvin is None else self.kelvin[sessions])

    @property
    def features(self) -> np.ndarray:
        """What the mean goes with [T, r]: the stretch, and the temperature where it is known and not the same."""
        columns = [(self.stretch == k).astype(float) for k in np.unique(self.stretch)]
        if self.kelvin is not None and np.ptp(self.kelvin) > 0:
            columns.append((self.kelvin - self.kelvin[0]) / 10.0)  # later sessions change nothing of it
        return np.column_stack(columns)

    @property
    def reach(self) -> np.ndarray:
        """How far each axis' mean may be from the first session [n], in moves."""
        return np.array([axis.reach for axis in self.axes])


def history(
    sessions: Sequence[SessionEvidence],
    days: Sequence[float],
    repairs: Sequence[bool],
    temperatures: Sequence[float | None],
) -> History:
    """The sessions on the axes that more than half of them tell of. A repair begins a new stretch with the session
    after it."""
    told = [_told(each) for each in sessions]
    first: dict[str, Axis] = {}
    for each, own in zip(sessions, told, strict=True):
        for name, k in own.items():
            first.setdefault(name, each.axes[k])
    here_often = [axis for name, axis in first.items() if 2 * sum(name in own for own in told) > len(told)]
    axes = tuple(sorted(here_often, key=lambda axis: not axis.number))
    matrices = np.zeros((len(sessions), len(axes), len(axes)))
    vectors = np.zeros((len(sessions), len(axes)))
    for t, (each, own) in enumerate(zip(sessions, told, strict=True)):
        here = [k for k, axis in enumerate(axes) if axis.name in own]
        place = [own[axes[k].name] for k in here]
        ratio = np.array([axes[k].scale / each.axes[own[axes[k].name]].scale for k in here])
        own_matrix = each.matrix[np.ix_(place, place)] * np.outer(ratio, ratio)
        matrices[t][np.ix_(here, here)] = own_matrix
        vectors[t, here] = own_matrix @ (each.at[place] / ratio) - each.gradient[place] * ratio
    stretch = np.cumsum(repairs)
    return History(
        axes, sum(axis.number for axis in axes), np.array(days), matrices, vectors, stretch, _kelvin(temperatures)
    )


def _kelvin(temperatures: Sequence[float | None]) -> np.ndarray | None:
    """Oil temperatures [K, T], that of the session before where one has none; None where half of them have none."""
    known = np.array([k for k, value in enumerate(temperatures) if value is not None], dtype=int)
    if 2 * known.size <= len(temperatures):
        return None
    last = np.maximum(np.searchsorted(known, np.arange(len(temperatures)), "right") - 1, 0)
    return np.array([temperatures[k] for k in known[last]], dtype=float)


def _told(session: SessionEvidence) -> dict[str, int]:
    """The places of the axes that a session tells of."""
    known = np.diag(session.matrix) > LEAST_INFORMATION
    return {axis.name: k for k, axis in enumerate(session.axes) if known[k]}


def estimates(of: History) -> tuple[np.ndarray, np.ndarray]:
    """Each axis' moves [T, n] with the rig's numbers free beside it, and their standard deviations [T, n]."""
    n, k = len(of.axes), of.numbers
    moves, deviations = np.empty((2, len(of.days), n))
    for t, (matrix, vector) in enumerate(zip(of.matrix, of.vector, strict=True)):
        own = np.linalg.inv(matrix[:k, :k] + np.diag(of.reach[:k] ** -2.0))
        moves[t, :k], deviations[t, :k] = own @ vector[:k], np.sqrt(np.diag(own))
        beside = matrix[k:, :k] @ own
        left = np.maximum(np.diag(matrix)[k:] - np.einsum("ij,ij->i", beside, matrix[k:, :k]), 1e-12)
        moves[t, k:] = (vector[k:] - beside @ vector[:k]) / left
        deviations[t, k:] = 1.0 / np.sqrt(left)
    return moves, deviations


def wander(of: History) -> np.ndarray:
    """Variances [n] by which a healthy rig's axes move from session to session, beyond what recordings tell.

    Of the first sessions, by the median square of second differences, which neither a jump nor a steady wear moves
    much; what oil and supply do to healthy rigs counts as so many sessions more, since few differences tell little.
    Later sessions do not count: what wears would hide itself.
    """
    moves, deviations = estimates(of.until(EARLY))
    early, told = moves, np.median(deviations**2, axis=0)
    healthy = np.square([axis.healthy for axis in of.axes])
    second = np.diff(early, n=2, axis=0) ** 2 / 6
    spread = np.median(second, axis=0) / _NORMAL_MEDIAN if len(second) else told
    share = len(early) / (len(early) + _PRIOR_SESSIONS)
    mixed = share * np.maximum(spread - told, 0.0) + (1 - share) * healthy
    return np.maximum(mixed, LEAST_SHARE * healthy) + NOISE_SHARE**2 * told


@dataclass(frozen=True, eq=False)
class Marginal:
    """Information of sessions without the wander: M [T, n, n], v [T, n]; designs X [T, n, p] of the mean, and how far
    each of its columns may go [p], in moves."""

    matrix: np.ndarray
    vector: np.ndarray
    design: np.ndarray
    reach: np.ndarray

    def with_column(self, axis: int, course: np.ndarray) -> "Marginal":
        """With a change that is known of, of some size."""
        column = np.zeros((*self.vector.shape, 1))
        column[:, axis, 0] = course
        design = np.concatenate((self.design, column), axis=2)
        return Marginal(self.matrix, self.vector, design, np.append(self.reach, _BROAD))

    def until(self, count: int) -> "Marginal":
        """The first sessions alone."""
        return Marginal(self.matrix[:count], self.vector[:count], self.design[:count], self.reach)

    def solved(self) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of the normal matrix of the means [p, p], and X'M X's way from M's column to them [T, p, n]."""
        weighted = np.swapaxes(self.design, 1, 2) @ self.matrix
        normal = np.tensordot(weighted, self.design, ((0, 2), (0, 1)))
        return np.linalg.inv(normal + np.diag(self.reach**-2.0)), weighted


def marginal(of: History, variance: np.ndarray) -> Marginal:
    """The history's information when the axes wander with a variance [n]: (A^-1 + W)^-1 and what goes with it.

    By eigenvalues of W^1/2 A W^1/2, which may span more decades than a difference of matrices keeps.
    """
    root = np.sqrt(variance)
    values, vectors = np.linalg.eigh(of.matrix * np.outer(root, root))
    values = np.maximum(values, 0.0)
    back = np.swapaxes(vectors, 1, 2)
    matrix = (vectors * (values / (1 + values))[:, None, :]) @ back / np.outer(root, root)
    kept = (vectors / (1 + values)[:, None, :]) @ back
    vector = np.einsum("tij,tj->ti", kept, of.vector * root) / root
    features = of.features
    design = np.einsum("tr,nm->tnrm", features, np.eye(len(variance)))
    return Marginal(matrix, vector, design.reshape(*vector.shape, -1), np.tile(of.reach, features.shape[1]))


def course(days: np.ndarray, first: int, shape: Shape, end: int | None = None) -> np.ndarray:
    """How a change of size 1 goes on [T], up to its `end`: a jump at a session, or a drift that begins with the one
    before it, by 1 a year."""
    at = np.arange(len(days))
    here = (at >= first) & (at < (len(days) if end is None else end))
    return here.astype(float) if shape == "jump" else here * (days - days[first - 1]) / 365.25
