"""What a platform's joints and payload lack, by the keys of trace.json."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..wrench.candidates import WrenchCandidate
from ..wrench.closed import Closed
from ..wrench.fitted import PayloadFit, WrenchProblem, fit_payload
from ..wrench.search import WrenchTrace, trace_wrench

_RANKED = 6


@dataclass(frozen=True, eq=False)
class WrenchAnswer:
    """The payload; what is `told` of joints and payload by the keys of trace.json, with `not_shown`, the names that the
    records cannot show; and the trace, None where records cannot judge: then the verdict is None, and `cells` says
    whether load cells measured the forces."""

    payload: PayloadFit
    told: Mapping[str, Any]
    trace: WrenchTrace | None
    cells: bool = True


def wrench_answer(problem: WrenchProblem) -> WrenchAnswer:
    """The answer to a platform's records."""
    if not problem.judges:
        return WrenchAnswer(fit_payload(problem), _told(None, [], None, None), None, problem.judging)
    trace = trace_wrench(problem)
    names = [effect.name for effect in trace.after.effects] if trace.verdict != "unknown" else []
    told = _told(
        trace.verdict, [*names, *_others(trace)], trace.before.chi2, trace.after.chi2 if names else trace.before.chi2
    )
    told["ranking"] = _ranking(trace)
    told["tied"] = {name: list(others) for name, others in trace.tied.items() if name in names}
    told["not_shown"] = list(trace.not_shown)
    return WrenchAnswer(trace.payload, told, trace)


def _told(verdict: str | None, effects: list[str], before: float | None, after: float | None) -> dict[str, Any]:
    equation = None if verdict in (None, "none") else "force"
    head = {"verdict": verdict, "effects": effects, "equation": equation, "chi2": {"before": before, "after": after}}
    return {**head, "ranking": [], "rms": {}, "numbers": [], "learned": [], "tied": {}, "not_shown": []}


def _others(trace: WrenchTrace) -> list[str]:
    """What ties with what was added."""
    return [name for others in trace.tied.values() for name in others] if trace.verdict == "tied" else []


def _ranking(trace: WrenchTrace) -> list[dict[str, Any]]:
    """What was added, with what it does together, then the best of the candidates alone."""
    named = trace.after.effects if trace.verdict != "unknown" else ()
    alone = {(judgement.name, judgement.formula): judgement.explained for judgement, _ in trace.ranking}
    keys = [(effect.name, effect.formula) for effect in named]
    rows = [_row(effect, trace.after, alone.get(key, 0.0)) for effect, key in zip(named, keys, strict=True)]
    others = [(each, closed) for each, closed in trace.ranking if (each.name, each.formula) not in keys]
    return [*rows, *(_row(closed.effects[-1], closed, each.explained) for each, closed in others[:_RANKED])]


def _row(effect: WrenchCandidate, closed: Closed, explained: float) -> dict[str, Any]:
    numbers = closed.parameters(effect)
    parameters = {f"{name} [{effect.units[name]}]": list(each) for name, each in numbers.items()}
    return {"effect": effect.name, "formula": effect.formula, "explained": explained, "parameters": parameters}
