"""The answer of a trace as plain numbers: trace.json, and what metrics.json has beside it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..identify.predict import Prediction, predictions
from ..identify.refit import Stand
from ..identify.trace import Trace, Tried
from .error_page import rms_of
from .fit_result import base_intervals, effect_intervals, finite


def trace_json(found: Trace) -> dict[str, Any]:
    """The answer by the keys of trace.json."""
    names = [one.candidate.effect.name for one in found.effects]
    return {
        "verdict": found.verdict,
        "effects": [*names, *found.tied] if found.verdict == "tied" else names,
        "equation": found.equation,
        "ranking": [_ranked(found, one, share) for one, share in ranking(found)],
        "chi2": dict(zip(("before", "after"), map(finite, found.chi2), strict=True)),
        "rms": rms_of(found.case.floor, compared(found, found.base), compared(found, found.final)),
    }


def more_json(found: Trace) -> dict[str, Any]:
    """What metrics.json has beside the answer."""
    failed = {f"{one.candidate.effect.title}": why for each in found.passes for one, why in failures(each.tried)}
    return {
        "base": base_intervals(found.case.rig, found.final.fit),
        "evidence": dict(found.evidence),
        "at_an_end": list(found.final.fit.held),
        "failed": failed,
        "scores": [
            {"effect": one.effect.name, "formula": one.effect.formula, "score": share, "pass": number}
            for number, each in enumerate(found.passes, 1)
            for one, share in each.scores
        ],
    }


def ranking(found: Trace) -> list[tuple[Tried, float]]:
    """Every refitted candidate once, with the share of the rig's misfit that it takes away beside those added before.

    Those that were added come first, then the best.
    """
    alone = found.passes[0].before if found.passes else found.base
    misfit = alone.squares - alone.samples
    tried = [(one, each) for each in found.passes for one in each.tried if _fits(one)]
    shares = [(one, _share(each.before, one, misfit)) for one, each in tried]
    added = {id(one): place for place, one in enumerate(found.effects)}
    shares.sort(key=lambda pair: (added.get(id(pair[0]), len(added)), -pair[1]))
    first: dict[tuple[str, str], tuple[Tried, float]] = {}
    for one, share in shares:
        first.setdefault((one.candidate.effect.name, one.candidate.effect.formula), (one, share))
    return list(first.values())


def failures(tried: Sequence[Tried]) -> list[tuple[Tried, str]]:
    """The candidates that could not be fitted, and why."""
    return [(one, one.failed or "some windows can not be simulated") for one in tried if not _fits(one)]


def compared(found: Trace, stand: Stand) -> list[Prediction]:
    """What a model predicts of every held-out record."""
    return predictions(stand.model, found.case.heldout, stand.x0, stand.fit.p)


def _fits(one: Tried) -> bool:
    return one.stand is not None and one.stand.fit.ok and bool(np.isfinite(one.stand.squares))


def _share(before: Stand, one: Tried, misfit: float) -> float:
    assert one.stand is not None
    return max(0.0, (before.squares - one.stand.squares) / misfit)


def _ranked(found: Trace, one: Tried, share: float) -> dict[str, Any]:
    effect, stand = one.candidate.effect, found.final if one in found.effects else one.stand
    assert stand is not None
    numbers = effect_intervals(effect, stand.fit)
    return {"effect": effect.name, "formula": effect.formula, "explained": share, "parameters": numbers}
