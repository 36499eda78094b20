"""What a platform's joints and payload lack, by the keys of trace.json."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..wrench.candidates import Candidate
from ..wrench.closed import Closed
from ..wrench.fitted import PayloadFit, WrenchProblem, fit_payload
from ..wrench.search import WrenchTrace, trace_wrench

_RANKED = 6


@dataclass(frozen=True, eq=False)
class WrenchAnswer:
    """The payload; what is `told` of joints and payload by the keys of trace.json, with `not_shown`, the names that the
    records cannot show; and the trace, None where no record at rest says the noise."""

    payload: PayloadFit
    told: Mapping[str, Any]
    trace: WrenchTrace | None


def wrench_answer(problem: WrenchProblem) -> WrenchAnswer:
    """Of a platform's records."""
    if not problem.judges:
        return WrenchAnswer(fit_payload(problem), _told("none", [], 1.0, 1.0), None)
    trace = trace_wrench(problem)
    names = [effect.name for effect in trace.after.effects] if trace.verdict != "unknown" else []
    told = _told(
        trace.verdict, [*names, *_others(trace)], trace.before.chi2, trace.after.chi2 if names else trace.before.chi2
    )
    told["ranking"] = _ranking(trace)
    told["tied"] = {name: list(others) for name, others in trace.tied.items() if name in names}
    told["not_shown"] = list(trace.not_shown)
    return WrenchAnswer(trace.payload, told, trace)


def _told(verdict: str, effects: list[str], before: float, after: float) -> dict[str, Any]:
    equation = None if verdict == "none" else "force"
    head = {"verdict": verdict, "effects": effects, "equation": equation, "chi2": {"before": before, "after": after}}
    return {**head, "ranking": [], "rms": {}, "numbers": [], "learned": [], "tied": {}, "not_shown": []}


def _others(trace: WrenchTrace) -> list[str]:
    """What ties with what was added."""
    return [name for others in trace.tied.values() for name in others] if trace.verdict == "tied" else []


def _ranking(trace: WrenchTrace) -> list[dict[str, Any]]:
    """What was added, with what it does together, then the best of the candidates alone."""
    first = trace.before
    named = trace.after.effects if trace.verdict != "unknown" else ()
    alone = {(judgement.name, judgement.formula): (judgement, closed) for judgement, closed in trace.ranking}
    rows = []
    for effect in named:
        judgement, _ = alone.get((effect.name, effect.formula), (None, first))
        rows.append(_row(effect, trace.after, judgement.explained if judgement else 0.0))
    keys = [(effect.name, effect.formula) for effect in named]
    others = [
        (judgement, closed) for judgement, closed in trace.ranking if (judgement.name, judgement.formula) not in keys
    ]
    return [*rows, *(_row(closed.effects[-1], closed, judgement.explained) for judgement, closed in others[:_RANKED])]


def _row(effect: Candidate, closed: Closed, explained: float) -> dict[str, Any]:
    numbers = closed.parameters(effect)
    parameters = {f"{name} [{effect.units[name]}]": list(each) for name, each in numbers.items()}
    return {"effect": effect.name, "formula": effect.formula, "explained": explained, "parameters": parameters}
