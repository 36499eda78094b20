"""Whether a rig changes over its sessions, since when, and until when: evidence of sessions against healthy wander.

A change is the mean of a healthy rig moving along one axis from some session on, at once or steadily, and back at once
where it is mended. Its gain is the fall of the squared errors that one number, the size of the change, brings (a
generalised likelihood ratio: Basseville and Nikiforov, Detection of Abrupt Changes, Prentice Hall 1993, ch. 4). What
limit a gain has to pass is drawn: healthy years of this rig's own sessions.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import get_args

import numpy as np

from .history import EARLY, FEWEST, History, Marginal, Shape, course, marginal, wander
from .session_evidence import Axis

CAUTION = 2.0  # on the limit: a wander known from few sessions has longer tails than the drawn ones
AT_ONCE = 5.0  # times its limit, at which one session tells a change; less has to show in two in a row
PER_KELVIN = {"b": -0.03, "beta": -0.004, "Cl": 0.025}  # of the number: as mineral oil HLP 46 about 40 degC
SEASON = 8.0  # K, of oil whose temperature nobody recorded, over a year
ROUNDING = 1e-6
MOST = 4  # changes that are told, one after the other
_DRAWS = 200
_LOOKS = 12
_TAUS = 24
_BEGINNINGS = 6  # that are tried with every end
_SHORTEST = 2  # sessions of a change that has ended
_SCALED = 0.9  # quantile of an axis' own healthy gains, by which axes are compared

Case = tuple[int, Shape, int | None]  # the first session with a change, how it goes on, the first one without it again


@dataclass(frozen=True, eq=False)
class Change:
    """A change from session `first` on, between `earliest` and `latest`; `gain` over the limit; `axis`: the one along
    which it shows most at first order; `size` (of a drift: a year) along it, in moves; `end`: the first session without
    it again, None where it goes on."""

    axis: int
    shape: Shape
    first: int
    gain: float
    size: float
    earliest: int
    latest: int
    end: int | None = None

    def among(self, left: np.ndarray) -> "Change":
        """The change of sessions `left` [k], by their numbers among all."""
        first, earliest, latest = (int(left[each]) for each in (self.first, self.earliest, self.latest))
        end = None if self.end is None else int(left[self.end])
        return replace(self, first=first, earliest=earliest, latest=latest, end=end)


def open_cases(count: int) -> list[Case]:
    """Beginnings over so many sessions, evenly, in every shape, of changes that go on."""
    firsts = np.unique(np.linspace(1, count - 1, _TAUS).astype(int)).tolist()
    return [(first, shape, None) for first, shape in product(firsts, get_args(Shape))]


def gains(
    of: Marginal, days: np.ndarray, vectors: np.ndarray, cases: Iterable[Case] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The gain [c, n, R] and the size [c, n, R] of every case (by default those that go on) on every axis.

    `vectors` [T, n, R] are of R histories at once.
    """
    inverse, weighted = of.solved()
    mean = inverse @ np.tensordot(of.design, vectors, ((0, 1), (0, 1)))
    gain, size = [], []
    for case in open_cases(len(days)) if cases is None else cases:
        s = course(days, *case)
        across = np.tensordot(s, weighted, 1)
        whole = np.einsum("t,tmm->m", s * s, of.matrix)
        known = whole - np.sum(across * (inverse @ across), axis=0)
        slope = np.tensordot(s, vectors, 1) - across.T @ mean
        told = known > ROUNDING * whole  # else the mean explains it as well, and what is left is rounding
        size.append(np.where(told[:, None], slope / np.where(told, known, 1.0)[:, None], 0.0))
        gain.append(slope * size[-1])
    return np.array(gain), np.array(size)


def limits(known: History, of: Marginal, a_year: float, seed: int = 0) -> np.ndarray:
    """The gain [n] of each axis that healthy histories pass so often `a_year`, all axes together, looked at after
    every session.

    Healthy histories have this rig's own A and W; where nobody recorded the oil's temperature, it has its season.
    """
    most = healthy_gains(known, of, seed)
    own = np.quantile(most, _SCALED, axis=1)
    own = np.where(own > 0, own, np.inf)  # no change shows along an axis that no session tells of twice alike
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
    if known.kelvin is None:
        drawn = drawn + np.einsum("tij,tjr->tir", of.matrix, _seasons(known, random))
    most = np.zeros((n, _DRAWS))
    for until in np.unique(np.linspace(min(FEWEST, count), count, _LOOKS).astype(int)):
        most = np.maximum(most, gains(of.until(until), known.days[:until], drawn[:until])[0].max(axis=0))
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
    cases = [case for case in open_cases(len(of.days)) if latest is None or case[0] <= latest]
    return _largest(of, rest, least, cases)


def _largest(of: History, rest: Marginal, least: np.ndarray, cases: Sequence[Case]) -> Change | None:
    """The change of one of the cases that is furthest over its limit, if one is."""
    if not cases:
        return None
    gain, size = gains(rest, of.days, rest.vector[..., None], cases)
    over = gain[..., 0] / least[None, :]
    best, axis = np.unravel_index(int(np.argmax(over)), over.shape)
    if over[best, axis] < 1:
        return None
    first, shape, end = cases[int(best)]
    near = [cases[c][0] for c in range(len(cases)) if over[c, axis] >= 0.95 * over[best, axis]]
    size_then = float(size[best, axis, 0])
    return Change(int(axis), shape, first, float(over[best, axis]), size_then, min(near), max(near), end)


@dataclass(frozen=True, eq=False)
class Telling:
    """A change and the session after which it was told, both among the sessions `left` [k] that it was found in."""

    left: np.ndarray
    change: Change
    told: int


def all_told(of: History, a_year: float) -> list[Telling]:
    """Change after change. The sessions of one that has ended are set aside, and the others say whether there is
    another; beside one that goes on none is looked for."""
    left, found = np.arange(len(of.days)), list[Telling]()
    while len(found) < MOST:
        own, told = first_told(of.some(left), a_year)
        if own is None:
            break
        found.append(Telling(left, own, told))
        if own.end is None:
            break
        left = np.delete(left, np.arange(own.earliest, own.end))
    return sorted(found, key=lambda each: int(each.left[each.told]))


def first_told(of: History, a_year: float) -> tuple[Change | None, int]:
    """The change as the whole history shows it, and the session [index] after which one was first told, with which it
    has begun at the latest. One odd session tells nothing unless it is far off: two in a row have to."""
    count = len(of.days)
    if count < FEWEST:
        return None, 0
    whole = marginal(of, wander(of))
    least = limits(of, whole, a_year)
    shown = (_over(of, whole, least, each) for each in range(FEWEST - 1, count + 1))
    told = next((k - 1 for k, (a, b) in enumerate(pairwise(shown), FEWEST) if b >= AT_ONCE or min(a, b) >= 1), None)
    if told is None:
        return None, count - 1
    lasting = change(of, whole, least, told) or change(of, whole, least)
    return _ended(of, least, told, lasting) or lasting, told


def _ended(of: History, least: np.ndarray, told: int, lasting: Change | None) -> Change | None:
    """The change that was told after a session, where it has ended since; None where one that lasts explains as much.

    A repair after that session is no new mean here: whether it mended the change is asked. As one odd session tells no
    change, one alone tells no end.
    """
    since = replace(of, stretch=np.minimum(of.stretch, of.stretch[told]))
    rest = marginal(since, wander(of))
    firsts = {*np.linspace(1, told, _BEGINNINGS).astype(int).tolist(), *([lasting.first] if lasting else [])}
    ends = range(told + 1, len(of.days))
    cases = [case for case in product(sorted(firsts), get_args(Shape), ends) if case[2] - case[0] >= _SHORTEST]
    found, goes_on = _largest(since, rest, least, cases), change(since, rest, least)
    if found is None or found.end is None:
        return None
    more = found.gain - (goes_on.gain if goes_on else 0.0)
    seen = len(of.days) - found.end
    return found if more >= (1.0 if seen > 1 else AT_ONCE) else None


def _over(of: History, whole: Marginal, least: np.ndarray, count: int) -> float:
    """The gain over its limit of the change that so many sessions show, 0 without one. How the rig wanders is known
    once the first of them are there."""
    if count < FEWEST:
        return 0.0
    until = of.until(count)
    rest = whole.until(count) if count >= EARLY else marginal(until, wander(until))
    found = change(until, rest, least)
    return found.gain if found else 0.0
