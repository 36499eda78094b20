"""The search for a rig's own shape, tier by tier, with stages that a resumed trace reads back."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

from ...base.checkpoint import no_checkpoint
from ...plant.effects import Effect
from . import rule as decide
from .context import TraceContext
from .left_out import left_out_squares
from .locate import FaultLocation
from .problem import EstimationProblem
from .refit import FittedModel
from .reshape import REFITS, WORTH, Reshaping, best, offered, refit_reshaped, scored
from .stored import packed_candidate, packed_refit, unpacked, unpacked_candidate

ROUNDS = 3  # reshapings that may follow one another
ENOUGH = 0.5  # of the misfit: a reshaping with more numbers is asked for where none takes this away
_SAME = 1e-6  # of a gain: within that two reshapings do the same
_TOGETHER = 8  # reshapings that a worker scores at a time: each time it computes what the numbers could do as well


def best_reshaping(
    context: TraceContext, number: int, before: FittedModel, place: FaultLocation | None
) -> tuple[Effect, FittedModel] | None:
    """The effect as reshaped, or learned, and the fit with it: the best of the tiers up to the first in which one takes
    ENOUGH of the misfit; None where none passes. `place`: where the misfit of `before` sits, if that is known."""
    problem, taken, candidates = context.problem, None, 0
    refits: list[tuple[Reshaping, FittedModel]] = []
    borne_out = _borne_out(context, number)
    equation = (place or context.location(f"shapes-{number}", before)).equation
    for tier, reshapings in enumerate(offered(problem, before, equation)):
        scores = _scores(context, f"{number}-{tier}", before, reshapings)
        refits += _refits(context, number, before, distinct(scores[:REFITS]))
        candidates += len(scores)
        while (taken := best(problem, before, refits, max(candidates, 1))) and not borne_out(before, *taken):
            refits.remove(taken)
        if taken and decide.explained(before.squares, taken[1].squares, before.samples) >= ENOUGH:
            break
    return (taken[0].candidate.effect, taken[1]) if taken else None


def distinct(scores: Sequence[tuple[Reshaping, float]]) -> list[Reshaping]:
    """Reshapings with their gains, most first, less those that are another by name alone: a force on the load that no
    load cell sees is one on the moving mass, and gains the same to the last digits."""
    kept: list[tuple[Reshaping, float]] = []
    for each, gain in scores:
        twins = [k for k, other in kept if k.candidate.effect.formula == each.candidate.effect.formula
                 and abs(gain - other) <= _SAME * other]  # fmt: skip
        if not twins:
            kept.append((each, gain))
    return [each for each, _ in kept]


def _borne_out(context: TraceContext, number: int) -> Callable[[FittedModel, Reshaping, FittedModel], bool]:
    """Whether a reshaping explains what it is WORTH where fits are made again without parts of free runs."""

    @cache
    def left_out(name: str, fit: FittedModel) -> float:
        squares = context.stage(
            f"left-out-{number}-{name}", lambda: {"sum": float(left_out_squares(context.problem, fit).sum())}
        )
        return float(squares["sum"])

    def borne_out(before: FittedModel, reshaping: Reshaping, after: FittedModel) -> bool:
        if context.problem.select or not context.problem.train.free_run:
            return True
        title = reshaping.candidate.effect.title
        share = decide.explained(left_out("before", before), left_out(title, after), context.problem.train.samples)
        context.report_progress(f"shape {number}: {title} explains {100 * share:.1f} % of parts left out")
        return share >= WORTH

    return borne_out


def _scores(
    context: TraceContext, name: str, before: FittedModel, reshapings: Sequence[Reshaping]
) -> list[tuple[Reshaping, float]]:
    def compute() -> list[dict[str, Any]]:
        context.steps.begin(f"shape {name}, scores of {len(reshapings)} reshapings", "reshapings", len(reshapings))
        items = [_packed(each) for each in reshapings]
        parts = {str(first): items[first : first + _TOGETHER] for first in range(0, len(items), _TOGETHER)}
        results = context.workers(_score_part, before, parts, no_checkpoint, lambda _: None)
        context.steps.done(len(reshapings) or 1)
        return sorted((entry for part in results for entry in part["scores"]), key=lambda entry: -entry["gain"])

    return [
        (_unpacked(entry, context.library, context.problem), float(entry["gain"]))
        for entry in context.stage(f"scores-shape-{name}", compute)
    ]


def _refits(
    context: TraceContext, number: int, before: FittedModel, reshapings: Sequence[Reshaping]
) -> list[tuple[Reshaping, FittedModel]]:
    """Reshapings that could be refitted, with their fits, up to the first that leaves no misfit.

    Workers that would wait go ahead; what was refitted in vain is left out, so that the answer does not depend on how
    many there are.
    """
    titles = [reshaping.candidate.effect.title for reshaping in reshapings]
    if titles:
        context.steps.begin(f"shape {number}, fits with {', '.join(titles)}", "shapes", len(titles))
    refits: list[tuple[Reshaping, FittedModel]] = []
    count = context.workers.count
    for first in range(0, len(titles), count):
        for title, reshaping, stored in _refitted(context, number, before, reshapings[first : first + count]):
            if "failed" in stored:
                continue
            fitted = unpacked(stored, context.problem, context.library)
            context.report_progress(f"shape {number}: {title}: chi2 {fitted.chi2:.4g} on what it did not see")
            refits.append((reshaping, fitted))
            if not context.is_misfit(fitted):
                return refits
    return refits


def _refitted(
    context: TraceContext, number: int, before: FittedModel, reshapings: Sequence[Reshaping]
) -> list[tuple[str, Reshaping, dict[str, Any]]]:
    """Titles, reshapings and what stages keep of their fits, by workers at once."""
    titles = [reshaping.candidate.effect.title for reshaping in reshapings]
    context.steps.say(", ".join(titles))
    items = {f"shape-{number}-{title}": _packed(each) for title, each in zip(titles, reshapings, strict=True)}
    results = context.workers(_refit, before, items, context.stage, lambda _: context.steps.done())
    return list(zip(titles, reshapings, results, strict=True))


def _score_part(
    problem: EstimationProblem, library: Sequence[Effect], before: FittedModel, items: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Scores of some reshapings."""
    scores = scored(problem, before, [_unpacked(item, library, problem) for item in items])
    return {"scores": [_packed(each) | {"gain": gain} for each, gain in scores]}


def _refit(
    problem: EstimationProblem, library: Sequence[Effect], before: FittedModel, item: Mapping[str, Any]
) -> dict[str, Any]:
    """The fit with a reshaping: see reshape.py."""
    return packed_refit(lambda: refit_reshaped(problem, before, _unpacked(item, library, problem)))


def _packed(reshaping: Reshaping) -> dict[str, Any]:
    return packed_candidate(reshaping.candidate) | {"place": reshaping.place}


def _unpacked(stored: Mapping[str, Any], library: Sequence[Effect], problem: EstimationProblem) -> Reshaping:
    return Reshaping(unpacked_candidate(stored, library, problem.samples), stored["place"])
