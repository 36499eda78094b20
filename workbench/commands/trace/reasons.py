"""What the rule says of a candidate of a trace, and the numbers by which it does."""

from ...identify.trace import rule as decide
from ...identify.trace.findings import CandidateFit, Pass, Trace


def reason(trace: Trace, search: Pass, fit: CandidateFit) -> str:
    """What the rule says of a candidate: why it counts, or why it does not."""
    judged, accepted = fit.judgement, [each.judgement for each in search.accepted]
    if fit in trace.effects:
        return "added"
    if judged.against:
        return judged.against
    if fit in trace.refuted:
        return "explains what was selected by, but the held-out records do not bear it out"
    if judged.explained < decide.NAMED and judged.chi2 >= decide.CLOSED:
        return f"real, but explains less than {100 * decide.NAMED:.0f} %"
    if fit in search.accepted:
        return _left_out(trace, search)
    if not accepted:
        return "real, but explains too little beside another effect"
    what = "formula" if judged.name in [each.name for each in accepted] else "effect"
    if judged.explained > max(each.explained for each in accepted) - decide.TIED:
        return f"another {what} explains as much with fewer numbers"
    return f"another {what} explains more"


def _left_out(trace: Trace, search: Pass) -> str:
    """Why an effect was not added that a pass accepted."""
    others = [fit.judgement.name for fit in search.accepted if fit in (*trace.effects, *trace.refuted)]
    if others:
        return f"as good as {others[0]}"
    if len({fit.judgement.kin for fit in search.accepted}) > 1:
        return "an effect of another family explains as much"
    return "real, but takes away too little of what the rig alone misses"


def accident(trace: Trace, search: Pass, fit: CandidateFit) -> tuple[float, float]:
    """What speaks against an accident: fall of BIC on train records, chance of the gain where nothing was fitted."""
    model_fit = fit.refitted
    squares = float(search.before.fit.squares.sum()), float(model_fit.fit.squares.sum())
    fall = decide.bic_fall(*squares, len(fit.candidate.effect.fitted), model_fit.fit.samples)
    return fall, decide.chance(search.before.squares, model_fit.squares, trace.problem.kappa, trace.candidates)
