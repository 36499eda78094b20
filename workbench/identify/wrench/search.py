"""What a platform's joints and payload lack, by the rule of a trace: added on fitted records, confirmed on held-out
ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...rigs.platform.effects import FLEXIBLE
from ..trace import rule
from .balance import NUMBERS, linear_numbers
from .candidates import WrenchCandidate, flexible, leg_candidates, not_shown
from .closed import PAYLOAD, Closed
from .fitted import FITTED, JUDGED, PayloadFit, WrenchProblem, payload_fit

MOST = 3  # effects
_FREQUENCIES = np.geomspace(3.0, 60.0, 25)  # Hz: where the search for a part that gives way starts
_DAMPINGS = (0.01, 0.1)
_FAR = 20.0  # m: from the origin, where no payload is
Ranking = Sequence[tuple[rule.Judgement, Closed]]


@dataclass(frozen=True, eq=False)
class WrenchTrace:
    """What was found: the balance `before` with the payload's numbers alone and `after` with what was added, the
    payload, what ties with each added name, what every candidate alone would do, best first, the verdict, and the
    names that these records cannot show."""

    before: Closed
    after: Closed
    payload: PayloadFit
    tied: Mapping[str, list[str]]
    ranking: Ranking
    verdict: str
    not_shown: Sequence[str]


def trace_wrench(problem: WrenchProblem) -> WrenchTrace:
    """Joints and payload of a platform whose records can judge; see `WrenchProblem.judges`."""
    linear = linear_numbers(np.array([problem.platform[name] for name in NUMBERS]))
    start = after = Closed(problem, problem.platform, (), linear)
    deviation = float(np.sqrt(2 / start.samples(JUDGED) + 2 / problem.noise.samples))
    tied: dict[str, list[str]] = {}
    first: Ranking = ()
    while rule.misfit(after.chi2, deviation) and len(after.effects) < MOST:
        ranking = _judged(after)
        first = first or ranking
        chosen = _chosen(ranking, after)
        if not chosen:
            break
        after, *others = chosen
        if others:
            tied[after.effects[-1].name] = [each.effects[-1].name for each in others]
    verdict = _verdict(start, after, tied, deviation)
    shown = not_shown(problem.signals[FITTED])
    return WrenchTrace(start, after, _payload(after), tied, first, verdict, shown)


def _verdict(start: Closed, after: Closed, tied: Mapping[str, list[str]], deviation: float) -> str:
    """The verdict by the rule of a jack's trace: what is added explains most of the misfit, or nothing is named."""
    if not rule.misfit(start.chi2, deviation):
        return "none"
    share = rule.explained(start.squares[JUDGED], after.squares[JUDGED], start.samples(JUDGED))
    if not after.effects or (share < rule.NAMED and rule.misfit(after.chi2, deviation)):
        return "unknown"
    if after.chi2 > rule.complete(start.chi2, deviation):
        return "incomplete"
    return "tied" if tied else "named"


def _payload(closed: Closed) -> PayloadFit:
    return payload_fit(closed.problem, closed.numbers[:PAYLOAD], closed.covariance[:PAYLOAD, :PAYLOAD])


def _chosen(ranking: Ranking, before: Closed) -> list[Closed]:
    """The best candidate and what ties with it; nothing where none explains enough of what is left to be one of
    several."""
    lead = rule.lead_by_noise(before.squares[JUDGED] - before.samples(JUDGED), 1.0, len(ranking))
    named = rule.named([judgement for judgement, _ in ranking], rule.PARTIAL, lead)
    return [closed for each in named for judgement, closed in ranking if judgement is each]


def _judged(before: Closed) -> Ranking:
    """Every candidate added to what was found, best first."""
    there = [effect.name for effect in before.effects]
    candidates = [each for each in leg_candidates(before.problem.signals[FITTED]) if each.name not in there]
    tried = [before.given(each) for each in candidates]
    if FLEXIBLE not in there:
        tried.append(before.given(_flexible(before)))
    judged = [(_judgement(before, each, len(tried)), each) for each in tried]
    return sorted(judged, key=lambda pair: -pair[0].explained)


def _judgement(before: Closed, after: Closed, candidates: int) -> rule.Judgement:
    effect, (was, now) = after.effects[-1], (each.squares[JUDGED] for each in (before, after))
    fall = rule.bic_fall(before.squares[FITTED], after.squares[FITTED], len(effect.units), before.samples(FITTED))
    against = rule.accident(was, now, fall, 1.0, candidates)
    explained = rule.explained(was, now, before.samples(JUDGED))
    return rule.Judgement(effect.name, effect.formula, explained, after.chi2, len(effect.units), against, effect.kin)


def _flexible(before: Closed) -> WrenchCandidate:
    """The part that gives way with the frequency, damping and height that close the fitted records best."""
    from scipy.optimize import least_squares

    def made(numbers: np.ndarray) -> WrenchCandidate:
        return flexible(float(np.exp(numbers[0])), float(np.exp(numbers[1])), float(numbers[2]))

    height = before.numbers[3] / before.numbers[0]
    starts = [np.array([np.log(f), np.log(damping), height]) for f in _FREQUENCIES for damping in _DAMPINGS]
    best = min(starts, key=lambda start: before.given(made(start)).squares[FITTED])
    low, high = ([np.log(f), np.log(z), -_FAR * scale] for f, z, scale in ((1.0, 1e-4, 1.0), (200.0, 2.0, -1.0)))
    return made(least_squares(lambda x: before.given(made(x)).left(FITTED), best, bounds=(low, high), max_nfev=20).x)
