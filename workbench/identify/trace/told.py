"""Which effects the records of a closed loop can show, and which look alike there: before any effect is tried.

A loop hides effects: integral action a bias, high gain a friction. What is left of each at its typical strength, once
numbers and initial states have taken what they can, says so, and the cosines of pairs say which look alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...plant.effects import Effect
from . import rule as decide
from .information import alternatives, cosines, effect_information, effects_alone, linked
from .problem import EstimationProblem
from .refit import FittedModel


@dataclass(frozen=True)
class ToldEffects:
    """Names of effects that records `shown` at their typical strength, those that they `hidden`, and groups of `alike`
    ones, each linked by cosines above ALIKE."""

    shown: list[str]
    hidden: list[str]
    alike: list[list[str]]


def told_effects(problem: EstimationProblem, base: FittedModel, library: Sequence[Effect]) -> ToldEffects:
    """What the train records tell of the effects of `library`, about the fitted rig alone."""
    effects = effect_information(problem, base, alternatives((), library))
    alone = effects_alone(effects.of_fit(problem.train), base.fit)
    names = np.array([candidate.effect.name for candidate in effects.candidates])
    noise = problem.deviation(problem.train.samples)
    seen = np.diag(alone) >= problem.train.samples * (decide.gate(noise) - 1)  # not of one that cannot be simulated
    shown = names[seen].tolist()
    near = cosines(alone[seen][:, seen]) >= decide.ALIKE
    return ToldEffects(shown, names[~seen].tolist(), linked(shown, near))
