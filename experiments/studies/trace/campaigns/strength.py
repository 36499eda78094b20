"""How strong a drawn effect is: so strong that the misfit which a refit of the base model leaves has a given size."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from workbench.base.errors import InputError
from workbench.plant.effects import Effect

from .cause import Cause

MOST = 1e4  # of an effect's typical strength
ENOUGH, CLOSE, TRIALS = 0.15, 0.03, 8  # of log(chi2 - 1); of log strength, between what is too weak and too strong
SHAPE = 2.0  # factor within which numbers are drawn that only shape an effect


@dataclass(frozen=True)
class Strength:
    """An effect's numbers [SI], their strength over the typical one, and the chi2 that a refit is expected to leave of
    held-out records and of train records."""

    numbers: dict[str, float]
    strength: float
    chi2: float
    train: float = np.inf


def shaped(effect: Effect, seed: np.random.Generator) -> dict[str, float]:
    """The numbers without an `off`, log-uniform within a factor of two of the typical ones, in their bounds."""
    drawn = {}
    for number in effect.numbers:
        factor = SHAPE ** seed.uniform(-1, 1)
        if number.off is None:
            drawn[number.name] = float(np.clip(number.typical * factor, number.low, number.high))
    return drawn


def scaled(effect: Effect, shape: Mapping[str, float], strength: float) -> dict[str, float]:
    """All numbers: those with an `off` at that strength between it (0) and their typical value (1), in their bounds."""
    numbers = dict(shape)
    for number in effect.numbers:
        if number.off is not None:
            value = number.off + strength * (number.typical - number.off)
            numbers[number.name] = float(np.clip(value, number.low, number.high))
    return numbers


def settle(
    misfit: Callable[[dict[str, float]], float],
    cause: Cause,
    shape: Mapping[str, float],
    goal: float,
    first: float = 1.0,
) -> Strength:
    """The strength at which `misfit` of the numbers is `goal`: false position on logarithms, in a bracket that halves.

    `first` is tried first. Where bounds or a failing simulation keep it from the goal, the nearest that can be had.
    """
    low, high, step = np.log(cause.least), np.log(MOST), float(np.log(first))
    trials: list[Strength] = []
    for _ in range(TRIALS):
        numbers = scaled(cause.effect, shape, float(np.exp(step)))
        try:
            chi2 = misfit(numbers)
        except InputError:
            chi2 = np.inf
        trials.append(Strength(numbers, float(np.exp(step)), float(chi2)))
        miss = off(chi2, goal)
        if abs(miss) < ENOUGH:
            break
        low, high = (step, high) if miss < 0 else (low, step)
        if high - low < CLOSE:
            break
        guess = step - np.clip(miss / 2, -3.0, 3.0)  # chi2 - 1 goes with the strength squared
        step = guess if low < guess < high else (low + high) / 2
    return min(trials, key=lambda trial: abs(off(trial.chi2, goal)))


def off(chi2: float, goal: float) -> float:
    """By how much, on a logarithm, a misfit is beyond the goal."""
    return float(np.log(max(chi2 - 1, 1e-6) / (goal - 1)))
