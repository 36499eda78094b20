"""Which candidates explain the fitted records as well as another value of a described number."""

from ..trace import rule as decide
from ..trace.findings import CandidateFit, Trace


def explain_alike(trace: Trace, number: str) -> tuple[list[str], str]:
    """Titles of the candidates within TIED of the one that shifts a number, in its pass; and the number's equation."""
    for search in reversed(trace.passes):
        tried = [fit for fit in search.tried if fit.model_fit is not None]
        own = next((fit for fit in tried if fit.candidate.effect.shifts == number), None)
        if own is not None:
            before = search.before.fit
            most = _squares(own) + decide.TIED * (float(before.squares.sum()) - before.samples)
            alike = [fit.candidate.effect.title for fit in tried if fit is not own and _squares(fit) <= most]
            return alike, own.candidate.effect.equation
    return [], ""


def _squares(fit: CandidateFit) -> float:
    return float(fit.refitted.fit.squares.sum())
