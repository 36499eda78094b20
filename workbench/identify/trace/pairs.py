"""Which two effects could explain a residual that neither does alone? The score test with both, without a refit.

Beside numbers and initial states, an effect tried at a small strength changes the errors along a unit vector, and alone
it fits best with an amplitude a, so that the squared errors fall by a^2. Two with the cosine c between them fit best
together with (a - b c)/(1 - c^2) and (b - a c)/(1 - c^2), and the squared errors fall by

    (a^2 + b^2 - 2 a b c)/(1 - c^2)

(least squares in two directions; Rao's score test with two degrees of freedom). Each may fall short alone, or even have
the wrong sign: what one leaves undone, the other hides.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..fit.free_parameters import Candidate
from .rule import ALIKE
from .score import EffectDirection


@dataclass(frozen=True)
class CandidatePair:
    """Two effects, the one that gains more alone first, with the numbers to start a common refit from, and the fall of
    the squared errors."""

    candidates: tuple[Candidate, Candidate]
    gain: float


def joint_amplitudes(amplitudes: np.ndarray, cosines: np.ndarray) -> np.ndarray:
    """The amplitude of each direction [k, k] that fits best beside each other one, from those alone [k]; 0 beside one
    that is ALIKE."""
    apart = np.abs(cosines) < ALIKE
    beside = amplitudes[:, None] - cosines * amplitudes[None, :]
    return np.where(apart, beside / np.where(apart, 1 - cosines**2, 1.0), 0.0)


def joint_gains(amplitudes: np.ndarray, cosines: np.ndarray, one_sided: np.ndarray) -> np.ndarray:
    """The fall of the squared errors [k, k] with two directions; 0 where one of them would have to be what it cannot:
    `one_sided` [k] ones have no negative amplitude."""
    beside = joint_amplitudes(amplitudes, cosines)
    possible = ~one_sided[:, None] | (beside > 0)
    gains = beside * amplitudes[:, None]
    return np.where(possible & possible.T, gains + gains.T, 0.0)


def best_pairs(trials: Sequence[EffectDirection], most: int) -> list[CandidatePair]:
    """The `most` pairs of names that explain most together, best first, each in its best formulas and strengths.

    Left out are pairs of one family, and those that explain no more than one effect.
    """
    moving = [trial for trial in trials if trial.square > 0]
    if not moving:
        return []
    shapes = np.array([trial.shape for trial in moving])
    cosines, amplitudes = shapes @ shapes.T, np.array([trial.amplitude for trial in moving])
    beside = joint_amplitudes(amplitudes, cosines)
    gains = np.triu(joint_gains(amplitudes, cosines, np.array([not trial.two_sided for trial in moving])), 1)
    alone = max(trial.gain for trial in moving)
    pairs: dict[frozenset[str], CandidatePair] = {}
    for place in np.argsort(-gains, axis=None, kind="stable"):
        i, j = sorted(divmod(int(place), len(moving)), key=lambda k: -moving[k].gain)
        first, second = moving[i], moving[j]
        gain = float(max(gains[i, j], gains[j, i]))
        if len(pairs) == most or gain <= alone:
            break
        if first.effect.kin != second.effect.kin:
            both = first.candidate(beside[i, j]), second.candidate(beside[j, i])
            pairs.setdefault(frozenset((first.effect.name, second.effect.name)), CandidatePair(both, gain))
    return list(pairs.values())
