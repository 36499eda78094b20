"""What a finished trace leaves to be recorded: one question for each effect that was named, for each number that
something explains as well, or for the equations that something is missing in; and what simulated records say to each.
"""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ...base.checkpoint import Progress, Stage
from ...plant.effects.declared import effects_for
from ..fit.free_parameters import Candidate
from ..fit.windows import predicted
from ..found.alike import fits_alike
from ..found.fitted import effect_numbers
from ..trace.findings import CandidateFit, Trace
from ..trace.information import alternatives
from ..trace.localise import BETWEEN
from .advice import Advice, Question, advised

EQUATIONS = "equations"
"""The key of the question where something is missing."""
_BEFORE_SPOOL = ("drive", "pilot", "main")
_OF_A_SIDE = 3  # effects that stand for an equation


def advice(trace: Trace, numbers: Sequence[str], stage: Stage, progress: Progress) -> dict[str, Advice]:
    """What to record next: by the effect that was named, by EQUATIONS, or by one of the `numbers` of the rig that the
    records contradict."""
    model_fit = trace.named

    def compute(question: Question) -> dict[str, Any]:
        progress(f"what to record next for {' and '.join(question.names)}")
        found = asdict(advised(trace.problem, model_fit, question))
        return {key: value for key, value in found.items() if key != "names"}  # a stage keeps no tuples

    said = {}
    for key, question in questions(trace, numbers).items():
        stored = stage(f"advice {key}", lambda question=question: compute(question))
        said[key] = Advice(question.names, **stored)
    return said


def questions(trace: Trace, numbers: Sequence[str]) -> dict[str, Question]:
    """What is to be asked of simulated records, by key; see `advice`."""
    asked = {}
    if trace.verdict != "none" and trace.equation is not None:
        asked = {fit.candidate.effect.name: _of_effect(trace, fit) for fit in trace.effects}
        asked = asked or {EQUATIONS: _of_equations(trace)}
    for number in numbers:
        sides = {fit.candidate.effect.title: (_refitted(fit),) for fit in fits_alike(trace, number)}
        if len(sides) > 1:
            asked[number] = Question((number, *list(sides)[1:]), tuple(sides.values()))
    return {key: question for key, question in asked.items() if any(question.sides)}


def _of_effect(trace: Trace, fit: CandidateFit) -> Question:
    """An effect that was added, against those that would do in its place."""
    effect = fit.candidate.effect
    own = Candidate(effect, effect_numbers(effect, trace.named.fit))
    others = [each for search in trace.passes for each in (*search.accepted, *search.tried)]
    first = {each.candidate.effect.name: each for each in reversed(others)}
    tied = [name for name in fit.tied if name in trace.tied and name in first]
    return Question((effect.name, *tied), ((own,), *((_refitted(first[name]),) for name in tied)))


def _refitted(fit: CandidateFit) -> Candidate:
    """An effect with the numbers of its own fit."""
    effect, model_fit = fit.candidate.effect, fit.model_fit
    known = model_fit is not None and effect.name in {each.name for each in model_fit.effects}
    return Candidate(effect, effect_numbers(effect, model_fit.fit)) if model_fit and known else fit.candidate


def _of_equations(trace: Trace) -> Question:
    """The equations that something is missing in, each with those of its effects that come nearest.

    Before a spool that nobody records anything may be missing that a flow imitates: the spool alone tells then.
    """
    names, plant = tuple(trace.equations), trace.base.model.plant
    unseen = "spool" in predicted(plant) and "spool" not in trace.problem.train.names
    sides = {name: _like(trace, name) for name in names}
    if set(names) == BETWEEN and unseen:
        return Question(names, (sides["drive"],), known=False, through="spool")
    return Question(names, tuple(side for side in sides.values() if side), known=False)


def _like(trace: Trace, equation: str) -> tuple[Candidate, ...]:
    """The effects of an equation that explain most of the misfit, then the library's first."""
    located = {name for name, _ in trace.evidence}
    within = {equation} | ({*_BEFORE_SPOOL} - located if equation == "drive" else set())
    scored = [pair for search in trace.passes[:1] for pair in search.scores if pair[0].effect.equation in within]
    rest = [effect for effect in effects_for(trace.problem.rig) if effect.equation in within]
    return alternatives(scored, rest)[:_OF_A_SIDE]
