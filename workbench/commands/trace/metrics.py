"""The answer of a trace as plain numbers: trace.json, and what metrics.json has beside it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...identify.fit.predict import Prediction, predictions
from ...identify.trace.findings import CandidateFit, Trace
from ...identify.trace.refit import FittedModel
from ..common.error_page import rms_of
from ..common.fit_result import base_intervals, effect_intervals, finite

Both = tuple[Sequence[Prediction], Sequence[Prediction]]


def trace_json(found: Trace) -> dict[str, Any]:
    """The answer by the keys of trace.json."""
    names = [one.candidate.effect.name for one in found.effects]
    return {
        "verdict": found.verdict,
        "effects": [*names, *found.tied] if found.verdict == "tied" else names,
        "equation": found.equation,
        "ranking": [_ranked(found, one, share) for one, share in ranking(found)],
        "chi2": dict(zip(("before", "after"), map(finite, found.chi2), strict=True)),
        "rms": rms_of(found.case.floor, *compared(found)),
    }


def more_json(found: Trace) -> dict[str, Any]:
    """What metrics.json has beside the answer."""
    failed = {f"{one.candidate.effect.title}": why for each in found.passes for one, why in failures(each.tried)}
    return {
        "base": base_intervals(found.case.rig, found.final.fit),
        "evidence": dict(found.evidence),
        "cuts": dict(found.cuts),
        "at_an_end": list(found.final.fit.held),
        "failed": failed,
        "scores": [
            {"effect": one.effect.name, "formula": one.effect.formula, "score": share, "pass": number}
            for number, each in enumerate(found.passes, 1)
            for one, share in each.scores
        ],
    }


def ranking(found: Trace) -> list[tuple[CandidateFit, float]]:
    """Every refitted candidate once, with the share of the rig's misfit that it takes away beside those added before.

    Those that were added come first, then the best.
    """
    if not found.passes:
        return []
    first = found.passes[0].before
    shares = [
        (one, max(0.0, (each.before.squares - one.stand.squares) / (first.squares - first.samples)))
        for each in found.passes
        for one in each.tried
        if one.stand is not None and _fits(one.stand)
    ]
    added = {id(one): place for place, one in enumerate(found.effects)}
    shares.sort(key=lambda pair: (added.get(id(pair[0]), len(added)), -pair[1]))
    once: dict[tuple[str, str], tuple[CandidateFit, float]] = {}
    for one, share in shares:
        once.setdefault((one.candidate.effect.name, one.candidate.effect.formula), (one, share))
    return list(once.values())


def failures(tried: Sequence[CandidateFit]) -> list[tuple[CandidateFit, str]]:
    """The candidates that could not be fitted, and why."""
    return [
        (one, one.failed or "some windows can not be simulated")
        for one in tried
        if one.stand is None or not _fits(one.stand)
    ]


def compared(found: Trace) -> Both:
    """What the rig alone, and the rig with what was added, predict of every held-out record."""
    heldout = found.case.heldout
    before = predictions(found.base.model, heldout, found.base.x0, found.base.fit.p)
    if found.final is found.base:
        return before, before
    return before, predictions(found.final.model, heldout, found.final.x0, found.final.fit.p)


def labels(found: Trace) -> list[str]:
    """What the fitted rig is called, and the rig with what was added, where something was."""
    if not found.effects:
        return ["fitted rig"]
    return ["fitted rig alone", f"with {' and '.join(one.candidate.effect.name for one in found.effects)}"]


def _fits(stand: FittedModel) -> bool:
    return stand.fit.ok and bool(np.isfinite(stand.squares))


def _ranked(found: Trace, one: CandidateFit, share: float) -> dict[str, Any]:
    effect, stand = one.candidate.effect, found.final if one in found.effects else one.stand
    assert stand is not None
    numbers = effect_intervals(effect, stand.fit)
    return {"effect": effect.name, "formula": effect.formula, "explained": share, "parameters": numbers}
