"""Which rigs are commissioned: jack-10t with other numbers, effects that its datasheet does not declare, and traps; and
other benches with other numbers alone."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from workbench.base import trust
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse, Rig

from ..trace.campaigns.cause import OTHER_FORMULA_CAUSES, UNNAMED_CAUSES, Cause, causes_on
from ..trace.campaigns.strength import scaled, shaped
from .benches import OTHERS, bench_of, datasheet_of
from .other_formulas import HIDDEN, SCALE, named

EFFECT_FILE = Path(__file__).with_name("other_formulas.py")
OFF = 0.5  # of the way to a bound, that a number may be off
STRONGEST = 4.0  # over an effect's typical strength
_STICKS = 20.0  # the same, of a spool that sticks
TRANSDUCER, STICKING = "transducer 3 % off", "spool that sticks"
_TRAP_EVERY, _PAIR_EVERY, _UNNAMED_EVERY = 5, 4, 10
_PLAIN = ("piston seal that opens", "air drag", "null shift", "gain that gives way")


@dataclass(frozen=True)
class HiddenEffect:
    """An effect that a rig has, with its numbers, SI."""

    name: str
    formula: str
    numbers: Mapping[str, float]


@dataclass(frozen=True)
class HiddenPlan:
    """A rig to commission: what its numbers are over those of the datasheet, what it has besides, its noise.

    trap: a transducer that reads 3 % too much, or a main spool that sticks, beside the effect. bench: one of OTHERS, or
    jack-10t where that is empty.
    """

    number: int
    seed: int
    ratios: Mapping[str, float]
    effects: tuple[HiddenEffect, ...]
    coloured: bool
    trap: str
    bench: str = ""

    @property
    def id(self) -> str:
        """The name of its folder."""
        return self.bench or f"rig-{self.number:02d}"


def hidden_plan(rig: Rig, number: int, seed: int) -> HiddenPlan:
    """The rig of a number: every fourth has two effects, every tenth one without a name, every fifth a trap."""
    drawn = np.random.default_rng([seed, number])
    ratios = _ratios(rig, drawn)
    trap = (TRANSDUCER, STICKING)[number // _TRAP_EVERY % 2] if number % _TRAP_EVERY == 2 else ""
    causes = _causes(rig, number, trap, drawn)
    most = _STICKS if trap == STICKING else STRONGEST
    effects = [_effect(cause, most, drawn) for cause in causes]
    if trap == TRANSDUCER:
        effects.append(HiddenEffect(SCALE, "", {"e": 0.03}))
    return HiddenPlan(number, seed, ratios, tuple(effects), bool(number % 2), trap)


def other_plan(number: int, seed: int) -> HiddenPlan:
    """The bench of a number, in their order, which lacks nothing that its datasheet has."""
    bench = list(OTHERS)[number % len(OTHERS)]
    ratios = _ratios(datasheet_of(bench), np.random.default_rng([seed, number]))
    return HiddenPlan(number, seed, ratios, (), False, "", bench)


def _ratios(rig: Rig, drawn: np.random.Generator) -> dict[str, float]:
    """True numbers over those of the datasheet; one that is 0 there is 0."""
    ratios = {}
    for each in rig.numbers.values():
        if each.low is not None and each.high is not None and each.value:
            share = float(drawn.uniform(-OFF, OFF))
            end = each.high if share > 0 else each.low
            ratios[each.name] = (each.value + abs(share) * (end - each.value)) / each.value
    return ratios


def hidden_rig(datasheet: Rig, plan: HiddenPlan) -> Rig:
    """The true rig behind the link: no number of it is uncertain."""
    trust.allow(EFFECT_FILE)
    numbers = {
        name: replace(number, value=number.value * plan.ratios.get(name, 1.0), low=None, high=None)
        for name, number in datasheet.numbers.items()
    }
    uses = tuple(EffectUse(each.name, each.formula, _numbers(each)) for each in plan.effects)
    true = replace(datasheet, numbers=numbers, effects=uses, effect_files=(str(EFFECT_FILE),))
    return bench_of(plan.bench).live(true)


def _numbers(effect: HiddenEffect) -> dict[str, Number]:
    """A hidden effect's numbers, as a rig declares them."""
    specs = next(each.numbers for each in HIDDEN if (each.name, each.formula) == (effect.name, effect.formula))
    return {each.name: Number(each.name, effect.numbers[each.name], each.si, each.si, "drawn") for each in specs}


def _causes(rig: Rig, number: int, trap: str, drawn: np.random.Generator) -> list[Cause]:
    others = causes_on(rig, OTHER_FORMULA_CAUSES)
    if trap == STICKING:
        return [cause for cause in others if cause.effect.name == "main.stiction"][:1]
    if number % _UNNAMED_EVERY == _UNNAMED_EVERY - 1:
        pool = [cause for cause in causes_on(rig, UNNAMED_CAUSES) if cause.effect.name in _PLAIN]
        return [pool[int(drawn.integers(len(pool)))]]
    names = list(dict.fromkeys(cause.effect.name for cause in others))
    first = names[number % len(names)]
    chosen = [first]
    if number % _PAIR_EVERY == _PAIR_EVERY - 1:
        kin = {cause.effect.name: cause.effect.family for cause in others}
        apart = [name for name in names if kin[name] != kin[first]]
        chosen.append(apart[int(drawn.integers(len(apart)))])
    return [_formula(others, name, drawn) for name in chosen]


def _formula(causes: list[Cause], name: str, drawn: np.random.Generator) -> Cause:
    own = [cause for cause in causes if cause.effect.name == name]
    return own[int(drawn.integers(len(own)))]


def _effect(cause: Cause, most: float, drawn: np.random.Generator) -> HiddenEffect:
    strength = float(most ** (1.0 if most > STRONGEST else drawn.uniform(0, 1)))
    numbers = scaled(cause.effect, shaped(cause.effect, drawn), strength)
    name = cause.effect.name if "." in cause.effect.name else named(cause.effect.name)
    return HiddenEffect(name, cause.effect.formula, numbers)
