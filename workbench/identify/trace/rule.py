"""The rule that names an effect, or does not: pure functions of squared errors on records that a fit did not see.

V0 and V are the squared errors over sigma before and with an effect, N their samples, kappa the autocorrelation factor
of the noise. A search compares by what was selected for it (see problem.py); held-out records then confirm its answer,
or nothing is named. The numbers are those of the study in docs/results/trace_study.md; none may be
loosened to name more.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

MISFIT = 0.05  # chi2 above 1 by this, or, where records tell it less well,
SURE = 4.0  # by so many of its standard deviations, is a misfit: noise alone passes once in 30,000 times
SIGNIFICANT = 30.0  # kappa: gain in log-likelihood of a disturbance in the best equation
CHANCE = 0.01  # that the best of all candidates gains as much from noise
BIC = 10.0  # kappa
NAMED = 0.8  # explained share of the misfit, or chi2 below
CLOSED = 1.05
FAR = 4.0  # chi2 that is left, twice the noise: from there on others mimic NAMED of a misfit, and PAIR is asked
TIED = 0.01  # of the explained share
NEIGHBOUR = 1.0  # of what a name leaves: a neighbour in its family ties that leaves no more than so much beyond it
PARTIAL = 0.3  # explained share from which an effect may be one of two
VAIN = PARTIAL / 2  # explained share of the fitted records below which the fit of an effect is not finished
PAIR = 0.95  # explained share of two effects of which neither would be named alone: two can mimic a third
LATER = 0.1  # of the first misfit: a later effect that takes away less may be what the first formula misses
FORMULA = 0.3  # of the noise's variance: what a right name may leave whose formula is not the rig's own
ALIKE = 0.95  # cosine from which two effects are one to these records: a tenth of the misfit tells them apart
ONE_OF_SEVERAL = 0.1  # explained share of what is left, where a rig is known to lack several effects


@dataclass(frozen=True)
class Judgement:
    """What one candidate does: `explained` share of the misfit, chi2 with it, numbers it has, and what speaks `against`
    it, empty where it counts; `kin` is the name of its family."""

    name: str
    formula: str
    explained: float
    chi2: float
    numbers: int
    against: str
    kin: str

    @property
    def passes(self) -> bool:
        """Whether it is no accident, and so counts."""
        return not self.against


def gate(deviation: float) -> float:
    """chi2 on what a fit did not see, above which something is missing; `deviation` is that of chi2 itself where
    nothing is (see NoiseFloor.deviation)."""
    return 1 + max(MISFIT, SURE * deviation)


def misfit(chi2: float, deviation: float) -> bool:
    """Whether chi2 on what a fit did not see says that something is missing."""
    return chi2 > gate(deviation)


def complete(before: float, deviation: float) -> float:
    """chi2 of held-out records up to which a name is all that is missing, of `before` without it: the gate, or what its
    formula may leave. That is FORMULA at most, and less than a later effect would have to take away to count."""
    return max(gate(deviation), 1 + min(FORMULA, LATER * (before - 1)))


def explained(before: float, after: float, samples: int) -> float:
    """The share of the misfit that an effect takes away, (V0 - V)/(V0 - N), 0 where it only harms."""
    if not np.isfinite(after) or before <= samples:
        return 0.0
    return max(0.0, (before - after) / (before - samples))


def confirmed(before: float, after: float, samples: int, deviation: float, several: bool = False) -> bool:
    """Whether held-out records bear out what was found: with it nothing is missing, or what is `asked` of it goes."""
    least = asked(after / samples, several)
    return not misfit(after / samples, deviation) or explained(before, after, samples) >= least


def asked(chi2: float, several: bool = False) -> float:
    """The share of the misfit that names have to explain that leave chi2; where a rig is known to lack `several`
    effects and some may not be found, what one of two has to."""
    if several:
        return PARTIAL
    return PAIR if chi2 > FAR else NAMED


def worth_adding(fall: float, first: float, samples: int) -> bool:
    """Whether a fall of the squared errors matters, of which the rig alone left `first`: at the floor none does."""
    return fall >= LATER * max(first - samples, MISFIT * samples)


def bic_fall(before: float, after: float, numbers: int, samples: int) -> float:
    """Fall of the squared errors on train records, less the price of its numbers (Schwarz's criterion)."""
    return before - after - numbers * float(np.log(samples))


def chance(before: float, after: float, kappa: float, candidates: int) -> float:
    """At most how likely the best of all candidates gains as much from noise, on what a fit did not see."""
    return min(1.0, candidates * float(ndtr(-np.sqrt(max(before - after, 0.0) / kappa))))


def lead_by_noise(misfit: float, kappa: float, candidates: int) -> float:
    """Share of a misfit, in squared errors, by which the best of all candidates leads from noise alone: the other way
    round than `chance`, at CHANCE."""
    return kappa * float(ndtri(CHANCE / max(candidates, 1))) ** 2 / misfit if misfit > 0 else np.inf


def accident(before: float, after: float, bic_fall: float, kappa: float, candidates: int) -> str:
    """Why an effect may be an accident; empty where BIC falls on train records and the gain elsewhere is beyond
    chance."""
    if not np.isfinite(after) or after >= before:
        return "the error where nothing was fitted does not fall"
    if bic_fall <= BIC * kappa:
        return "too little gain on the fitted records for its numbers"
    if chance(before, after, kappa, candidates) >= CHANCE:
        return "the gain where nothing was fitted may be chance"
    return ""


def best_pair(explained: Sequence[float], chi2: Sequence[float]) -> int | None:
    """Which of several pairs of effects is the one, by the share of the misfit that each explains and the chi2 that it
    leaves; None where none explains enough, or another explains as much: many pairs can mimic what is in no library."""
    able = [place for place, share in enumerate(explained) if share >= PAIR or chi2[place] < CLOSED]
    best = max(able, key=lambda place: explained[place], default=None)
    if best is None or any(explained[place] >= explained[best] - TIED for place in able if place != best):
        return None
    return best


def named(judgements: Sequence[Judgement], share: float = NAMED, lead: float = 0.0) -> list[Judgement]:
    """The best formulas of the effects that explain the misfit, best first; several: they tie; none: unknown.

    Of those within TIED of the best, or within the `lead` that noise may give, the one with the fewest numbers comes
    first, then their neighbours. `share` is what must be explained.
    """
    able = [
        judgement
        for judgement in judgements
        if judgement.passes and (judgement.explained >= share or judgement.chi2 < CLOSED)
    ]
    if not able:
        return []
    most = max(judgement.explained for judgement in able)
    near = sorted(
        (judgement for judgement in able if judgement.explained >= most - max(TIED, lead)),
        key=lambda judgement: (judgement.numbers, -judgement.explained),
    )
    near += _neighbours(near[0], most, judgements)
    return [
        judgement
        for place, judgement in enumerate(near)
        if judgement.name not in [other.name for other in near[:place]]
    ]


def _neighbours(best: Judgement, most: float, judgements: Sequence[Judgement]) -> list[Judgement]:
    """Those of the best one's family that the records do not exclude, where it explains the `most`.

    A likelihood takes one of the formulas for the truth. What the best one leaves beyond the noise shows that it is
    not, and another formula of a neighbour might do as well: to be excluded a neighbour must leave NEIGHBOUR of that
    more.
    """
    least = most - NEIGHBOUR * max(0.0, 1.0 - most)
    kin = [each for each in judgements if each.passes and each.kin == best.kin and each.name != best.name]
    return sorted((each for each in kin if each.explained >= least), key=lambda judgement: -judgement.explained)
