"""Platforms that are drawn: every leg has numbers of its own, and one, two or no legs have an effect.

The effects are of the library, one formula of each name in turn, as strong as a refit of the leg's numbers would leave
a drawn chi2. That is reckoned on records of the platform as it is drawn, before it has effects.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, cast

import numpy as np

from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.record.platform import PlatformPlan, platform_plan, run_platform_record
from workbench.identify.found.detectability import misfit_left
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.identify.trace.score import NuisanceProjection
from workbench.identify.wrench.leg_cut import cut_legs, whole_campaigns
from workbench.plant.effects import inside_port
from workbench.rigs.number import Number
from workbench.rigs.platform import LEGS, load_platform
from workbench.rigs.rig import EffectUse, Rig

from .campaigns.cause import LIBRARY_CAUSES, Cause, cause, causes_on
from .campaigns.strength import settle, shaped

PLATFORM = "hexapod"
SHARES = {"single": 0.6, "clean": 0.2, "pair": 0.2}
MISFIT = (2.0, 15.0)  # chi2 that a refit of the leg leaves, log-uniform
_CARRIED = "M"  # the mass that a jack alone carries, which no leg has
_DOUBTS = Number("flow_error", 10.0, "1", "1", "drawn: no guard holds an overlap or friction for a broken sensor")

Kind = Literal["single", "pair", "clean"]


@dataclass(frozen=True)
class DrawnPlatform:
    """A platform to draw; whatever is not said here follows from the seed.

    effects: the leg, counted from 1, the name and the formula of each; misfit: the chi2 that a refit of that leg's
    numbers should leave.
    """

    seed: int
    kind: Kind
    effects: tuple[tuple[int, str, str], ...] = ()
    misfit: float = 6.0

    @property
    def id(self) -> str:
        """The name of its folder."""
        return f"platform-{self.kind}-{self.seed}"

    @property
    def causes(self) -> list[tuple[int, Cause]]:
        """What its legs lack, by leg."""
        rig = load_platform(PLATFORM).legs[0].rig
        return [(leg, cause(name, formula, rig)) for leg, name, formula in self.effects]

    def known(self) -> dict[str, Any]:
        """What is known before it is drawn, by the keys of truth.json."""
        causes = self.causes
        return {
            "id": self.id,
            "kind": self.kind,
            "seed": self.seed,
            "noise": "white",
            "effects": [f"leg{leg}.{each.effect.name}" for leg, each in causes],
            "formula": [each.effect.formula for _, each in causes],
            "equations": list(dict.fromkeys(equation for _, each in causes for equation in each.equations)),
            "goal": self.misfit,
        }

    def draw(self, folder: Path) -> dict[str, Any]:
        """Write its campaign's folder and return what its legs are short of. Raises InputError."""
        drawn = np.random.default_rng([self.seed, 1])
        plan = platform_plan(PLATFORM, self.seed)
        plan = with_rigs(plan, [drawn_leg(leg.rig, drawn) for leg in plan.platform.legs])
        rigs = [leg.rig for leg in plan.platform.legs]
        numbers: dict[str, float] = {}
        for (leg, each), strength in zip(self.causes, _strengths(plan, self.causes, self.misfit, drawn), strict=True):
            rigs[leg - 1] = replace(rigs[leg - 1], effects=(*rigs[leg - 1].effects, _used(each, strength)))
            numbers |= {f"leg{leg}.{each.effect.key(name)}": value for name, value in strength.items()}
        leave_records(with_rigs(plan, rigs), folder)
        return self.known() | {"numbers": numbers}


def platform_draws(count: int, seed: int) -> list[DrawnPlatform]:
    """`count` platforms by SHARES, shuffled; the names of the library in turn, in legs that are drawn."""
    parts = np.floor(np.cumsum([0.0, *SHARES.values()]) * count + 0.5).astype(int)
    kinds = np.repeat(list(SHARES), np.diff(parts))
    order = np.random.default_rng([seed, 0])
    pool = [each for each in causes_on(load_platform(PLATFORM).legs[0].rig, LIBRARY_CAUSES) if _in_leg(each)]
    names = order.permutation(list(dict.fromkeys(each.effect.name for each in pool))).tolist()
    return [_drawn(cast(Kind, str(kinds[i])), seed, int(i), names, pool) for i in order.permutation(count)]


def _drawn(kind: Kind, seed: int, number: int, names: Sequence[str], pool: Sequence[Cause]) -> DrawnPlatform:
    """One platform; everything about it follows from seed and number."""
    drawn = np.random.default_rng([seed, 1, number])
    many = {"clean": 0, "single": 1, "pair": 2}[kind]
    legs = sorted(drawn.choice(LEGS, many, replace=False) + 1)
    effects = []
    for place, leg in enumerate(legs):
        formulas = [each for each in pool if each.effect.name == names[(number + place * len(names) // 2) % len(names)]]
        effects.append((int(leg), *formulas[drawn.integers(len(formulas))].key))
    misfit = float(np.exp(drawn.uniform(*np.log(MISFIT))))
    return DrawnPlatform(seed * 100_000 + number, kind, tuple(effects), misfit)


def _in_leg(each: Cause) -> bool:
    """Whether a leg that is cut out by its force can lack it, and a platform is simulated with it in one leg: commands
    come late in all legs or in none."""
    return inside_port(each.effect.laws) and not (each.effect.shifts or each.effect.delay)


def drawn_leg(rig: Rig, drawn: np.random.Generator) -> Rig:
    """The rig of a leg with numbers drawn inside their ranges."""
    values = {
        number.name: float(drawn.uniform(number.low, number.high))
        for number in rig.numbers.values()
        if number.low is not None and number.high is not None and number.name != _CARRIED
    }
    return replace(rig.with_values(**values), limits={**rig.limits, "flow_error": _DOUBTS})


def with_rigs(plan: PlatformPlan, rigs: Sequence[Rig]) -> PlatformPlan:
    legs = tuple(replace(leg, rig=rig) for leg, rig in zip(plan.platform.legs, rigs, strict=True))
    return replace(plan, platform=replace(plan.platform, legs=legs))


def _used(each: Cause, values: Mapping[str, float]) -> EffectUse:
    numbers = {n.name: Number(n.name, values[n.name], n.si, n.si, "drawn") for n in each.effect.numbers}
    return EffectUse(*each.key, numbers)


def _strengths(
    plan: PlatformPlan, causes: Sequence[tuple[int, Cause]], goal: float, drawn: np.random.Generator
) -> list[dict[str, float]]:
    """The numbers with which each effect leaves the chi2 `goal`, by slopes along the records of its leg without it."""
    if not causes:
        return []
    with TemporaryDirectory() as scratch:
        leave_records(plan, Path(scratch))
        declared = load_platform(PLATFORM)
        legs = cut_legs(declared, whole_campaigns(scratch))
    problems = [(estimation_problem(legs[leg - 1].campaign, legs[leg - 1].rig), each) for leg, each in causes]
    return [_strength(problem, each, goal, drawn) for problem, each in problems]


def _strength(problem: EstimationProblem, each: Cause, goal: float, drawn: np.random.Generator) -> dict[str, float]:
    base, model = fit_rig(problem), problem.model((each.effect,), brief=True)
    rest = NuisanceProjection(base.model, problem.train, base.fit)
    plain = base.model.errors(problem.train, base.fit.x0, base.fit.p)

    def chi2(numbers: dict[str, float]) -> float:
        left = misfit_left(model, problem, base, each.effect, numbers, rest, plain)
        return np.inf if left is None else 1.0 + left / problem.train.samples

    return settle(chi2, each, shaped(each.effect, drawn), goal).numbers


def leave_records(plan: PlatformPlan, folder: Path) -> None:
    """Leave the campaign of a platform as `jackbench record` does."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in run_platform_record(plan, no_checkpoint, lambda _: None).files.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
