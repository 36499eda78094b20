"""The laws of effects as fitted: over a natural variable, or over frequency, with the 95 % band that the fit gives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.units import from_si
from ...plant.effects import Effect, small_signal, static_curve
from ...plant.effects.natural import PASSAGES, NaturalVariable, variables
from ...plant.effects.shapes import offered_as
from ..fit.solver import Fit
from .fitted import effect_covariance, effect_numbers

BAND = 1.96  # standard deviations
_POINTS = 241
_TELLING = 0.1  # of the largest value of a formula: below it a relative difference says nothing
_BOTH = 0.1  # of the range on either side of 0: less is one side
_TYPICAL = 0.75  # quantile of the speeds at which a law is held
_STEP = 1e-3  # of a number's standard deviation, or of its magnitude where it has none: for slopes of a gain
_DISPLAY_UNITS = {"m^3/s": "l/min", "Pa": "bar", "A": "mA", "m": "mm"}


@dataclass(frozen=True, eq=False)
class LawCurve:
    """What a law passes on, `values` with `half` the width of their 95 % band, each [k, parts], in `unit`."""

    name: str
    unit: str
    values: np.ndarray
    half: np.ndarray


@dataclass(frozen=True)
class Difference:
    """The furthest difference of a law from a formula: index of place and part, and its share of the formula."""

    place: int
    part: int
    share: float


def visited(of: NaturalVariable, samples: Mapping[str, np.ndarray]) -> np.ndarray:
    """Places [k] SI over the range that the records visited, or the usual one; denser where a law bends most."""
    values = samples.get(of.word)
    low, high = of.usual if values is None else (float(values.min()), float(values.max()))
    if not low < 0 < high:
        return np.linspace(low, high, _POINTS)
    share = np.linspace(-1.0, 1.0, _POINTS)
    return np.sign(share) * np.abs(share) ** of.crowding * np.where(share < 0, -low, high)


def held_values(effect: Effect, word: str, samples: Mapping[str, np.ndarray]) -> dict[NaturalVariable, float]:
    """The effect's other natural variables, SI: the middle of what the records had; of a speed, a high one, forward."""
    return {
        of: float(np.quantile(np.abs(samples[of.word]), _TYPICAL) if of.si == "m/s" else np.median(samples[of.word]))
        for of in variables(effect)
        if of.word in samples and of.word != word
    }


def law_curve(
    effect: Effect, fit: Fit, name: str, word: str, at: np.ndarray, held: Mapping[NaturalVariable, float]
) -> LawCurve:
    """The first law of a fitted effect at places [k] of a variable; as a share of what passes where it is a factor."""
    slot = next(iter(effect.laws))
    others = {offer: value for of, value in held.items() if (offer := offered_as(slot, of.word))}
    curve = static_curve(effect, effect_numbers(effect, fit), word, at, others)
    variance = np.einsum("kpi,ij,kpj->kp", curve.slopes, effect_covariance(effect, fit), curve.slopes)
    half = BAND * np.sqrt(np.maximum(variance, 0.0))
    return _in_units(effect, LawCurve(name, "", curve.values, half), unchanged(effect, word, at))


def as_it_came(effect: Effect, word: str, at: np.ndarray) -> LawCurve | None:
    """What passes the slot without the effect; None where nothing does, so that the effect adds to nothing."""
    values = unchanged(effect, word, at)
    if not values.any():
        return None
    return _in_units(effect, LawCurve("the rig without it", "", values, np.zeros_like(values)), values)


def unchanged(effect: Effect, word: str, at: np.ndarray) -> np.ndarray:
    """What passes [k, parts] SI where the law changes nothing."""
    slot = next(iter(effect.laws))
    bare = replace(effect, laws={slot: lambda value, _: value}, numbers=(), states=())
    return static_curve(bare, {}, word, at).values


def differences(law: LawCurve, formula: LawCurve, at: np.ndarray, near: float) -> list[Difference]:
    """The furthest differences of a law from a formula, beyond its band, part by part.

    On either side of 0 where the places reach well to both, and not `near` it, where a sign turns; else where it is
    most above and most below.
    """
    parts = [_differences(law, formula, at, part, near) for part in range(law.values.shape[1])]
    return [difference for part in parts for difference in part]


def _differences(law: LawCurve, formula: LawCurve, at: np.ndarray, part: int, near: float) -> list[Difference]:
    own, other, half = law.values[:, part], formula.values[:, part], law.half[:, part]
    telling = (np.abs(other) > _TELLING * np.abs(other).max()) & (np.abs(own - other) > half)
    share = np.divide(own - other, other, out=np.zeros_like(own), where=telling)
    both = min(-at.min(), at.max()) > _BOTH * np.ptp(at)
    sides = (at < -near, at > near) if both else (share < 0, share > 0)
    shares = [np.where(side, share, 0.0) for side in sides]
    places = [int(np.argmax(np.abs(each))) for each in shares]
    return [
        Difference(place, part, float(each[place]))
        for place, each in zip(places, shares, strict=True)
        if each[place] != 0
    ]


def gain_curve(effect: Effect, fit: Fit, frequencies: np.ndarray) -> tuple[LawCurve, LawCurve]:
    """Gain [dB] and phase [deg] of a fitted effect for a `small_signal` at `frequencies` [k] Hz."""
    numbers, covariance = effect_numbers(effect, fit), effect_covariance(effect, fit)
    gain_of = small_signal(effect)
    response = gain_of(numbers, frequencies)
    slopes = np.zeros((len(frequencies), len(effect.numbers)), dtype=complex)
    for column, entry in enumerate(effect.numbers):
        if not entry.given:
            step = _STEP * (float(np.sqrt(covariance[column, column])) or abs(entry.typical))
            step = step if numbers[entry.name] + step <= entry.high else -step
            moved = gain_of({**numbers, entry.name: numbers[entry.name] + step}, frequencies)
            nothing = np.zeros(len(response), complex)  # where no signal passes, none is off
            slopes[:, column] = np.divide(moved - response, step * response, out=nothing, where=response != 0)

    def half(part: np.ndarray) -> np.ndarray:
        return BAND * np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", part, covariance, part), 0.0))[:, None]

    gain, phase = half(np.real(slopes)) * 20 / np.log(10), np.rad2deg(half(np.imag(slopes)))
    return (
        LawCurve(effect.name, "dB", gain_db(response)[:, None], gain),
        LawCurve(effect.name, "deg", phase_deg(response)[:, None], phase),
    )


def is_a_signal(effect: Effect) -> bool:
    """Whether an effect passes on a signal, whose gain over frequency says all of a linear element."""
    return PASSAGES[next(iter(effect.laws))].signal


def _in_units(effect: Effect, curve: LawCurve, plain: np.ndarray) -> LawCurve:
    """A curve [SI] in the unit that people read; in % of what passes, `plain`, where that is one value."""
    slot = next(iter(effect.laws))
    if plain.any() and not np.ptp(plain):
        return replace(curve, unit="%", values=100 * curve.values / plain, half=100 * curve.half / plain)
    si = _unit(slot)
    unit = _DISPLAY_UNITS.get(si, si)
    values = np.asarray(from_si(curve.values, unit, si))
    return replace(curve, unit=unit, values=values, half=np.asarray(from_si(curve.half, unit, si)))


def _unit(slot: str) -> str:
    parts: Sequence[str] = [part.unit for part in PASSAGES[slot].parts]
    return parts[0] if parts else "1"
