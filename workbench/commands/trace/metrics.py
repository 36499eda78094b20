"""The answer of a trace as plain numbers: trace.json, and what metrics.json has beside it."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ...base.numbers import finite
from ...identify.fit.predict import Prediction, predictions
from ...identify.found.alike import explain_alike
from ...identify.found.effect_by_effect import steps
from ...identify.found.errors import rms_of
from ...identify.found.fitted import base_intervals, effect_intervals, pinned
from ...identify.found.session_fit import session_fits
from ...identify.found.shifted import SHIFT, chi2_as_recorded, shifts
from ...identify.found.wrong_numbers import WrongNumber, wrong_numbers
from ...identify.trace.findings import CandidateFit, LearnedShape, Trace
from ...identify.trace.refit import FittedModel
from ...plant.effects import formula_shape
from ..common.sessions import sessions, sessions_json

MANY = 3  # additions: of more, labels and the first sentence give their number
Both = tuple[Sequence[Prediction], Sequence[Prediction]]


def trace_json(trace: Trace) -> dict[str, Any]:
    """The answer by the keys of trace.json."""
    names = [fit.candidate.effect.name for fit in trace.effects if not fit.candidate.effect.shifts]
    answer = {
        "verdict": trace.verdict if names or not trace.effects or trace.verdict != "named" else "none",
        "effects": [*names, *trace.tied] if trace.verdict == "tied" else names,
        "equation": trace.equation,
        **({} if trace.finished else {"finished": False}),
        "ranking": [_ranked(trace, fit, share) for fit, share in ranking(trace)],
        "chi2": dict(zip(("before", "after"), map(finite, trace.chi2), strict=True)),
        "rms": rms_of(trace.problem.floor, *compared(trace)),
        "learned": [_learned(shape) for shape in trace.learned],
        "numbers": [wrong.json() for wrong in numbers_of(trace)],
    }
    return answer | _with_shifts(trace, answer) if trace.problem.late else answer


def _with_shifts(trace: Trace, answer: dict[str, Any]) -> dict[str, Any]:
    """What the channels of a second logger, put back, change in an answer: names that tie stay by themselves."""
    tied = answer["verdict"] == "tied"
    return {
        "verdict": {"none": "named", "unknown": "incomplete"}.get(answer["verdict"], answer["verdict"]),
        "effects": answer["effects"] if tied else [SHIFT, *answer["effects"]],
        "equation": answer["equation"] if tied else "sensor",
        "ranking": [*(shift.json() for shift in shifts(trace)), *answer["ranking"]],
        "chi2": answer["chi2"] | {"before": finite(chi2_as_recorded(trace))},
    }


def numbers_of(trace: Trace) -> list[WrongNumber]:
    """The described numbers that the records contradict."""
    effects = [fit.candidate.effect for fit in trace.effects]
    return wrong_numbers(trace.problem.rig, trace.named.fit, effects)


def _learned(shape: LearnedShape) -> dict[str, Any]:
    """A learned shape by the keys of trace.json: slot, kinds of its words, variables that it goes with."""
    form = formula_shape(shape.effect)
    assert form is not None
    return {"slot": form.slot, "kind": form.kind, "variables": list(form.variables), "chi2": shape.chi2}


def more_json(trace: Trace) -> dict[str, Any]:
    """What metrics.json has beside the answer."""
    by_effect = steps(trace)
    in_sessions = [each.json() for each in session_fits(trace.problem, trace.final.fit)]
    tied = {fit.candidate.effect.name: list(fit.tied) for fit in trace.effects if fit.tied}
    alike = {wrong.number.name: explain_alike(trace, wrong.number.name) for wrong in numbers_of(trace)}
    failed = {f"{fit.candidate.effect.title}": why for search in trace.passes for fit, why in failures(search.tried)}
    return {
        "base": base_intervals(trace.problem.rig, trace.final.fit),
        "evidence": dict(trace.evidence),
        "cuts": dict(trace.parity_residuals),
        "equations": trace.equations,
        "sessions": sessions_json(sessions(trace.problem, trace.final.fit)),
        **({"session_numbers": in_sessions} if in_sessions else {}),
        **({"tied": tied} if tied else {}),
        **({"alike": alike} if alike else {}),
        **({"told": asdict(trace.told)} if trace.told else {}),
        "at_an_end": list(trace.final.fit.at_bounds),
        "pinned": pinned(trace.problem.rig),
        "failed": failed,
        **({"steps": [step.json() for step in by_effect]} if by_effect else {}),
        "scores": [
            {"effect": candidate.effect.name, "formula": candidate.effect.formula, "score": share, "pass": number}
            for number, each in enumerate(trace.passes, 1)
            for candidate, share in each.scores
        ],
    }


def ranking(trace: Trace) -> list[tuple[CandidateFit, float]]:
    """Every refitted candidate once, with the share of the rig's misfit that it takes away beside those added before.

    Those that were added come first, then the best.
    """
    if not trace.passes:
        return []
    first = trace.passes[0].before
    shares = [
        (fit, max(0.0, (search.before.squares - fit.model_fit.squares) / (first.squares - first.samples)))
        for search in trace.passes
        for fit in search.tried
        if fit.model_fit is not None and _fits(fit.model_fit)
    ]
    added = {id(fit): place for place, fit in enumerate(trace.effects)}
    shares.sort(key=lambda pair: (added.get(id(pair[0]), len(added)), -pair[1]))
    once: dict[tuple[str, str], tuple[CandidateFit, float]] = {}
    for fit, share in shares:
        once.setdefault((fit.candidate.effect.name, fit.candidate.effect.formula), (fit, share))
    return list(once.values())


def failures(tried: Sequence[CandidateFit]) -> list[tuple[CandidateFit, str]]:
    """The candidates that could not be fitted, and why."""
    return [
        (fit, fit.failed or "some windows cannot be simulated")
        for fit in tried
        if fit.model_fit is None or not _fits(fit.model_fit)
    ]


def compared(trace: Trace) -> Both:
    """What the rig alone, and the rig with what was added, predict of every held-out record."""
    heldout = trace.problem.heldout
    alone, _, added = trace.heldout
    before = predictions(trace.base.model, heldout, alone.x0, trace.base.fit.p)
    if trace.final is trace.base:
        return before, before
    return before, predictions(trace.final.model, heldout, added.x0, trace.final.fit.p)


def labels(trace: Trace) -> list[str]:
    """What the fitted rig is called, and the rig with what was added, where something was."""
    names = [fit.candidate.effect.name for fit in trace.effects]
    names += ["its learned shape" if names else "a learned piece"] if trace.learned else []
    if not names:
        return ["fitted rig"]
    return ["fitted rig alone", f"with {' and '.join(names)}" if len(names) <= MANY else f"with all {len(names)}"]


def _fits(model_fit: FittedModel) -> bool:
    return model_fit.fit.ok and bool(np.isfinite(model_fit.squares))


def _ranked(trace: Trace, fit: CandidateFit, share: float) -> dict[str, Any]:
    effect, model_fit = fit.candidate.effect, trace.named if fit in trace.effects else fit.model_fit
    assert model_fit is not None
    numbers = effect_intervals(effect, model_fit.fit)
    return {"effect": effect.name, "formula": effect.formula, "explained": share, "parameters": numbers}
