"""Whether a rig changes over its sessions, and since when: evidence of all sessions, against healthy wander.

A healthy rig's numbers wander from session to session with variances W about a mean that may be another one after each
repair, and that goes with the oil's temperature. A change is that mean moving along one axis from some session on, at
once or steadily. Its gain is the fall of the squared errors that one number, the size of the change, brings (a
generalised likelihood ratio: Basseville and Nikiforov, Detection of Abrupt Changes, Prentice Hall 1993, ch. 4). What
limit a gain has to pass is drawn: healthy years of this rig's own sessions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from .session_evidence import Axis, SessionEvidence

FEWEST = 8  # sessions that say how a healthy rig wanders; no alarm before
CAUTION = 2.0  # on the limit: a wander known from few sessions has longer tails than the drawn ones
AT_ONCE = 5.0  # times its limit, at which one session tells a change; less has to show in two in a row
BROAD = 10.0  # a mean may be so far from the first session, in moves
LEAST_INFORMATION = 1.0  # of an axis in any session; below it a recording says nothing of it
PER_KELVIN = {"b": -0.03, "beta": -0.004, "Cl": 0.025}  # of the number: as mineral oil HLP 46 about 40 degC
SEASON = 8.0  # K, of oil whose temperature nobody recorded, over a year
NOISE_SHARE = 0.3  # of a session's own uncertainty: no axis is thought to be steadier
ROUNDING = 1e-6
EARLY = 2 * FEWEST  # sessions that say how the rig wanders
_NORMAL_MEDIAN = 0.4549  # of the square of a normal variable
_PRIOR_SESSIONS, LEAST_SHARE = 8, 0.5  # sessions that the healthy wander counts as; the least that is left of it
_DRAWS = 200
_LOOKS = 12
_TAUS = 24
_SCALED = 0.9  # quantile of an axis' own healthy gains, by which axes are compared

Shape = Literal["jump", "drift"]
Case = tuple[int, Shape]


@dataclass(frozen=True, eq=False)
class History:
    """Sessions of one rig on common axes: days [T]; A [T, n, n] and c [T, n] of A q = c, q the moves [n];
    features [T, r]: the stretches between repairs, and the temperature where every session has one."""

    axes: tuple[Axis, ...]
    numbers: int
    days: np.ndarray
    matrix: np.ndarray
    vector: np.ndarray
    features: np.ndarray
    warm: bool

    def until(self, count: int) -> "History":
        """The first sessions alone."""
        features = self.features[:count]
        parts = (self.days[:count], self.matrix[:count], self.vector[:count], features[:, features.any(axis=0)])
        return History(self.axes, self.numbers, *parts, self.warm)


@dataclass(frozen=True, eq=False)
class Change:
    """A change from session `first` on, between `earliest` and `latest`; `gain` over the limit; `axis`: the one along
    which it shows most at first order; `size` (of a drift: a year) along it, in moves."""

    axis: int
    shape: Shape
    first: int
    gain: float
    size: float
    earliest: int
    latest: int


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
    warm = all(value is not None for value in temperatures)
    features = _features(repairs, temperatures)
    return History(axes, sum(axis.number for axis in axes), np.array(days), matrices, vectors, features, warm)


def _told(session: SessionEvidence) -> dict[str, int]:
    """The places of the axes that a session tells of."""
    known = np.diag(session.matrix) > LEAST_INFORMATION
    return {axis.name: k for k, axis in enumerate(session.axes) if known[k]}


def _features(repairs: Sequence[bool], temperatures: Sequence[float | None]) -> np.ndarray:
    stretch = np.cumsum(repairs) - int(bool(repairs) and repairs[0])
    columns = [(stretch == k).astype(float) for k in range(int(stretch.max()) + 1)]
    known = [value for value in temperatures if value is not None]
    if len(known) == len(temperatures) and np.ptp(known) > 0:
        columns.append((np.array(known) - known[0]) / 10.0)  # later sessions change nothing of it
    return np.column_stack(columns)


def estimates(of: History) -> tuple[np.ndarray, np.ndarray]:
    """Each axis' moves [T, n] with the rig's numbers free beside it, and their standard deviations [T, n]."""
    n, k = len(of.axes), of.numbers
    moves, deviations = np.empty((2, len(of.days), n))
    for t, (matrix, vector) in enumerate(zip(of.matrix, of.vector, strict=True)):
        own = np.linalg.inv(matrix[:k, :k] + np.eye(k) / BROAD**2)
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
    """Information of sessions without the wander: M [T, n, n], v [T, n]; designs X [T, n, p] of the mean."""

    matrix: np.ndarray
    vector: np.ndarray
    design: np.ndarray

    def with_column(self, axis: int, course: np.ndarray) -> "Marginal":
        """With a change that is known of, of some size."""
        column = np.zeros((*self.vector.shape, 1))
        column[:, axis, 0] = course
        return Marginal(self.matrix, self.vector, np.concatenate((self.design, column), axis=2))

    def until(self, count: int) -> "Marginal":
        """The first sessions alone."""
        return Marginal(self.matrix[:count], self.vector[:count], self.design[:count])

    def solved(self) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of the normal matrix of the means [p, p], and X'M X's way from M's column to them [T, p, n]."""
        weighted = np.swapaxes(self.design, 1, 2) @ self.matrix
        normal = np.tensordot(weighted, self.design, ((0, 2), (0, 1)))
        return np.linalg.inv(normal + np.eye(len(normal)) / BROAD**2), weighted


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
    design = np.einsum("tr,nm->tnrm", of.features, np.eye(len(variance)))
    return Marginal(matrix, vector, design.reshape(*vector.shape, -1))


def course(days: np.ndarray, first: int, shape: Shape) -> np.ndarray:
    """How a change of size 1 goes on [T]: a jump at a session, or a drift that begins with the one before it, by 1 a
    year."""
    if shape == "jump":
        return (np.arange(len(days)) >= first).astype(float)
    return np.maximum(days - days[first - 1], 0.0) / 365.25


def gains(of: Marginal, days: np.ndarray, vectors: np.ndarray) -> tuple[list[Case], np.ndarray, np.ndarray]:
    """Of every beginning and shape, and every axis: the gain [c, n, R] and the size [c, n, R].

    `vectors` [T, n, R] are of R histories at once.
    """
    inverse, weighted = of.solved()
    mean = inverse @ np.tensordot(of.design, vectors, ((0, 1), (0, 1)))
    firsts = np.unique(np.linspace(1, len(days) - 1, _TAUS).astype(int))
    cases: list[Case] = [(int(first), shape) for first in firsts for shape in ("jump", "drift")]
    gain, size = [], []
    for first, shape in cases:
        s = course(days, first, shape)
        across = np.tensordot(s, weighted, 1)
        whole = np.einsum("t,tmm->m", s * s, of.matrix)
        known = whole - np.sum(across * (inverse @ across), axis=0)
        slope = np.tensordot(s, vectors, 1) - across.T @ mean
        told = known > ROUNDING * whole  # else the mean explains it as well, and what is left is rounding
        size.append(np.where(told[:, None], slope / np.where(told, known, 1.0)[:, None], 0.0))
        gain.append(slope * size[-1])
    return cases, np.array(gain), np.array(size)


def limits(known: History, of: Marginal, a_year: float, seed: int = 0) -> np.ndarray:
    """The gain [n] of each axis that healthy histories pass so often `a_year`, all axes together, looked at after
    every session.

    Healthy histories have this rig's own A and W; where nobody recorded the oil's temperature, it has its season.
    """
    most = healthy_gains(known, of, seed)
    own = np.quantile(most, _SCALED, axis=1)
    return CAUTION * own * float(np.quantile((most / own[:, None]).max(axis=0), np.exp(-a_year * years(known))))


def years(known: History) -> float:
    """From the first session to the last."""
    return float(max(known.days[-1] - known.days[0], 1.0) / 365.25)


def healthy_gains(known: History, of: Marginal, seed: int) -> np.ndarray:
    """The largest gain [n, R] of each axis in R drawn healthy histories, looked at after every session."""
    count, n = of.vector.shape
    random = np.random.default_rng(seed)
    roots = np.linalg.cholesky(of.matrix + 1e-12 * np.trace(of.matrix, axis1=1, axis2=2)[:, None, None] * np.eye(n))
    drawn = np.einsum("tij,tjr->tir", roots, random.standard_normal((count, n, _DRAWS)))
    if not known.warm:
        drawn = drawn + np.einsum("tij,tjr->tir", of.matrix, _seasons(known, random))
    most = np.zeros((n, _DRAWS))
    for until in np.unique(np.linspace(min(FEWEST, count), count, _LOOKS).astype(int)):
        most = np.maximum(most, gains(of.until(until), known.days[:until], drawn[:until])[1].max(axis=0))
    return most


def _seasons(known: History, random: np.random.Generator) -> np.ndarray:
    """Moves [T, n, R] of axes that go with the oil's temperature, over years that begin at any time of them."""
    phases = random.uniform(0, 2 * np.pi, _DRAWS)
    kelvin = SEASON * np.sin(2 * np.pi * known.days[:, None] / 365.25 + phases)
    return np.einsum("n,tr->tnr", [_per_kelvin(axis) for axis in known.axes], kelvin)


def _per_kelvin(axis: Axis) -> float:
    return PER_KELVIN.get(axis.name, 0.0) * abs(axis.value) / axis.scale


def change(of: History, rest: Marginal, least: np.ndarray, latest: int | None = None) -> Change | None:
    """The change that a history without its wander shows, if one passes its axis' limit `least` [n]. It begins at the
    `latest` with that session."""
    cases, gain, size = gains(rest, of.days, rest.vector[..., None])
    over = gain[..., 0] / least[None, :]
    if latest is not None:
        over[[first > latest for first, _ in cases]] = 0.0
    best, axis = np.unravel_index(int(np.argmax(over)), over.shape)
    if over[best, axis] < 1:
        return None
    first, shape = cases[best]
    near = [cases[c][0] for c in range(len(cases)) if over[c, axis] >= 0.95 * over[best, axis]]
    return Change(int(axis), shape, first, float(over[best, axis]), float(size[best, axis, 0]), min(near), max(near))


def first_told(of: History, a_year: float) -> tuple[Change | None, int]:
    """The change as the whole history shows it, and the session [index] after which one was first told, with which it
    has begun at the latest. One odd session tells nothing unless it is far off: two in a row have to."""
    count = len(of.days)
    if count < FEWEST:
        return None, 0
    whole = marginal(of, wander(of))
    least = limits(of, whole, a_year)
    if change(of, whole, least) is None:
        return None, count - 1
    shown = (_over(of, whole, least, each) for each in range(FEWEST - 1, count + 1))
    told = next((k - 1 for k, (a, b) in enumerate(pairwise(shown), FEWEST) if b >= AT_ONCE or min(a, b) >= 1), None)
    if told is None:
        return None, count - 1
    return change(of, whole, least, told) or change(of, whole, least), told


def _over(of: History, whole: Marginal, least: np.ndarray, count: int) -> float:
    """The gain over its limit of the change that so many sessions show, 0 without one. How the rig wanders is known
    once the first of them are there."""
    if count < FEWEST:
        return 0.0
    until = of.until(count)
    rest = whole.until(count) if count >= EARLY else marginal(until, wander(until))
    found = change(until, rest, least)
    return found.gain if found else 0.0


def smoothed(of: History, found: Change | None) -> tuple[np.ndarray, np.ndarray]:
    """Moves [T, n] of every session and their standard deviations: the mean with its change, and the wander about it
    as far as the session's own recording tells it."""
    variance = wander(of) if len(of.days) > 2 else np.full(len(of.axes), BROAD**2)
    rest = marginal(of, variance)
    if found:
        rest = rest.with_column(found.axis, course(of.days, found.first, found.shape))
    inverse, _ = rest.solved()
    mean = rest.design @ (inverse @ np.einsum("tnp,tn->p", rest.design, rest.vector))
    known = np.linalg.inv(of.matrix + np.diag(1.0 / variance))
    about = np.einsum("tij,tj->ti", known, of.vector - np.einsum("tij,tj->ti", of.matrix, mean))
    # the mean's own uncertainty shows where a session says little
    reach = np.einsum("tij,jk->tik", known, np.diag(1.0 / variance)) @ rest.design
    spread = np.einsum("tnp,tnp->tn", reach @ inverse, reach)
    return mean + about, np.sqrt(np.einsum("tii->ti", known) + spread)
