"""Which candidates explain the fitted records as well as another value of a described number."""

from ..trace import rule as decide
from ..trace.findings import CandidateFit, Trace


def explain_alike(trace: Trace, number: str) -> list[str]:
    """Their titles."""
    return [fit.candidate.effect.title for fit in fits_alike(trace, number)[1:]]


def fits_alike(trace: Trace, number: str) -> list[CandidateFit]:
    """The candidate that shifts a number, and those within TIED of it in its pass; none where it was not fitted."""
    for search in reversed(trace.passes):
        tried = [fit for fit in search.tried if fit.model_fit is not None]
        own = next((fit for fit in tried if fit.candidate.effect.shifts == number), None)
        if own is not None:
            before = search.before.fit
            most = _squares(own) + decide.TIED * (float(before.squares.sum()) - before.samples)
            return [own, *(fit for fit in tried if fit is not own and _squares(fit) <= most)]
    return []


def _squares(fit: CandidateFit) -> float:
    return float(fit.refitted.fit.squares.sum())
