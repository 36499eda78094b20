"""What a campaign could have shown: from which strength on each effect would have been a misfit."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage
from ...base.errors import InputError
from ...plant.effects import Effect, EffectNumber, applies
from ..fit.free_parameters import at_strength, extend_parameters
from ..fit.model import Model
from ..trace import rule as decide
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel
from ..trace.score import NuisanceProjection, initial_states_with_effect

_LEAST, _MOST = 1e-3, 10.0  # strengths that are tried, over the typical one
_TRIES = 2  # an effect is not linear in its strength: look again where it should be visible


def detectability(
    problem: EstimationProblem, model_fit: FittedModel, library: Sequence[Effect], stage: Stage, progress: Progress
) -> list[dict[str, Any]]:
    """For the first formula of every effect the strength, over the typical one, that opens the gate; None: never."""
    first = {effect.name: effect for effect in reversed(library) if applies(effect, problem.rig)}
    effects = [effect for effect in library if first.get(effect.name) is effect]

    def compute() -> list[dict[str, Any]]:
        rest = NuisanceProjection(model_fit.model, problem.train, model_fit.fit)
        plain = model_fit.model.errors(problem.train, model_fit.fit.x0, model_fit.fit.p)
        rows = []
        for effect in effects:
            progress(f"from when on {effect.name} shows")
            rows.append({"effect": effect.name, "strength": _strength(problem, model_fit, effect, rest, plain)})
        return rows

    return stage("seen", compute)


def undetectable(rows: Sequence[dict[str, Any]]) -> list[str]:
    """The effects that would not even show at their typical strength."""
    return [row["effect"] for row in rows if row["strength"] is None or row["strength"] > 1]


def _strength(
    problem: EstimationProblem,
    model_fit: FittedModel,
    effect: Effect,
    rest: NuisanceProjection,
    plain: Sequence[np.ndarray],
) -> float | None:
    """The strength at which the misfit is as large as the gate asks for; None where the numbers' ranges end before."""
    target = problem.train.samples * (decide.gate(problem.deviation(problem.train.samples)) - 1)
    model = problem.model((*model_fit.effects, effect), brief=True)
    strength = 1.0
    for _ in range(_TRIES):
        size = misfit_left(model, problem, model_fit, effect, at_strength(effect, strength), rest, plain)
        if size is None:
            return strength
        strength = float(np.clip(strength * np.sqrt(target / max(size, 1e-12)), _LEAST, _MOST))
    within = all(_reached(number, strength) for number in effect.numbers)
    return strength if within and strength < _MOST else None


def misfit_left(
    model: Model,
    problem: EstimationProblem,
    model_fit: FittedModel,
    effect: Effect,
    numbers: Mapping[str, float],
    rest: NuisanceProjection,
    plain: Sequence[np.ndarray],
) -> float | None:
    """The squares that an effect with SI `numbers` would leave after a refit; None where it cannot be simulated.

    `model` has the effect, `model_fit` does not, and leaves the errors `plain`; `rest` takes away what a refit would.
    """
    p = extend_parameters(model_fit.model.plant, model_fit.fit.p, model.plant)
    p = model.plant.parameter_values(p, **{effect.key(name): value for name, value in numbers.items()})
    try:
        x0 = initial_states_with_effect(model, model_fit.model, problem.train, model_fit.fit.x0, p)
    except InputError:
        return None
    change = [a - b for a, b in zip(model.errors(problem.train, x0, p), plain, strict=True)]
    if not all(np.isfinite(part).all() for part in change):
        return None
    return float(np.sum(rest(change) ** 2))


def _reached(number: EffectNumber, strength: float) -> bool:
    return number.off is None or number.low <= number.off + strength * (number.typical - number.off) <= number.high
