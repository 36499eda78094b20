"""What a fit may move: the uncertain numbers of a rig, and those of an effect that it may lack."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...plant import Plant, build
from ...plant.effects import Effect, EffectNumber, numbers_of
from ...rigs.rig import Rig
from .determined import FreeParameter
from .model import COARSE_TOLERANCE, TOLERANCE, Model
from .session_numbers import SessionNumber

_DECADES = 10.0  # a positive number whose range spans more than this factor is searched by its logarithm


@dataclass(frozen=True)
class Candidate:
    """An effect with the numbers, SI by name, from which a fit starts."""

    effect: Effect
    start: Mapping[str, float]

    def free(self) -> tuple[FreeParameter, ...]:
        """Its numbers as a fit moves them, named as the plant names them."""
        return tuple(_free(self.effect, number, self.start[number.name]) for number in self.effect.fitted)


def uncertain(rig: Rig) -> tuple[FreeParameter, ...]:
    """The numbers of a rig and of the effects that it declares that have bounds, by the plant's names.

    Raises InputError where there are none.
    """
    free = tuple(
        FreeParameter(n.name, n.value, n.low, n.high, _scale(n.low, n.high), "declared range")
        for n in numbers_of(rig).values()
        if n.low is not None and n.high is not None and n.high > n.low
    )
    if not free:
        raise InputError(f"rig {rig.name}: no number has bounds, so there is nothing to fit; add bounds = [low, high]")
    return free


def at_strength(effect: Effect, strength: float, only: str | None = None) -> dict[str, float]:
    """The effect's numbers with the strengths at `strength` times their typical distance from off; or `only` one.

    What only shapes the effect is typical, and what is given.
    """
    return {n.name: _at(n, strength if only in (None, n.name) else 0.0) for n in effect.numbers}


def strengths(effect: Effect) -> list[str]:
    """Names of the numbers at whose off the effect is gone."""
    return [n.name for n in effect.fitted if n.off is not None]


def model_with(
    rig: Rig,
    effects: Sequence[Effect],
    names: Sequence[str],
    brief: bool = False,
    sessions: Sequence[SessionNumber] = (),
    coarse: bool = False,
) -> Model:
    """The model of a rig with effects beyond those that it declares; `coarse`: for free runs, whose errors are far
    above its own, and for what is compared with another coarse one."""
    tolerance = COARSE_TOLERANCE if coarse else TOLERANCE
    return Model(build(rig, effects), names, brief, sessions, tolerance)


def extend_parameters(base: Plant, values: np.ndarray, plant: Plant) -> np.ndarray:
    """The parameters of `plant` with the values that a plant of fewer effects has; those of sessions stay behind."""
    own = len(base.parameters)
    return np.append(plant.parameter_values(**dict(zip(base.parameters, values.tolist(), strict=False))), values[own:])


def _at(number: EffectNumber, strength: float) -> float:
    if number.off is None or number.given:
        return number.typical
    return float(np.clip(number.off + strength * (number.typical - number.off), number.low, number.high))


def _scale(low: float, high: float) -> float | None:
    return None if low > 0 and high > _DECADES * low else (high - low) / 2


def _free(effect: Effect, number: EffectNumber, start: float) -> FreeParameter:
    name, reason = effect.key(number.name), "range of the effect"
    if number.off is None and _scale(number.low, number.high) is None:
        return FreeParameter(name, start, number.low, number.high, None, reason)
    reach = abs(number.typical - number.off) if number.off is not None else (number.high - number.low) / 4
    return FreeParameter(name, start, number.low, number.high, reach, reason)
