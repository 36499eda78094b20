"""Drawn campaigns: recordings of a rig whose numbers, noise, excitation and missing effect a seed decides.

    truth = draw(Case(seed=7, kind="single", effects=(("jack.friction", "stribeck"),)), Path("c007"))

The folder holds what a bench would leave, and nothing that gives the answer away; the answer is what `draw` returns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ....base.errors import InputError
from ....base.signals import MEASURED
from ....base.toml_text import toml_text
from ....engine import Engine
from ....plant import build
from ....records.excitation import Excitation
from ....rigs.rig import Rig
from ....rigs.rig_file import load_rig
from .cause import Cause, cause
from .misfit import Misfit
from .noise import Noise, counts, noise, quantised, sigmas, write
from .play import PlayedMotion, play, start
from .programme import Programme, programme
from .strength import Strength, off, settle, shaped

JACK = "jack-10t"
FEW = ("current", "pa", "pb", "position")  # where sensors are missing
TOLERANCE = 1e-6  # of the simulation: far below what a fit resolves
PASSES, NEAR = 3, 0.3  # of the search for a strength; of log(chi2 - 1)
SMALLER, TRIES = 0.8, 8  # where a drawn excitation is too much for the rig

Kind = Literal["single", "pair", "off", "clean", "number"]


@dataclass(frozen=True)
class CampaignPlan:
    """A campaign to draw; whatever is not said here follows from the seed.

    effects: name and formula of each, see foreign.py. removed: names that the tracer's library is to be without.
    misfit: the held-out chi2 that a refit of the base model should leave. sharp: how fast the command is, up to 1.
    few: no spool, acceleration and supply sensors. poor: hardly any excitation. corrector: of the rig's valve, that
    the command drives; empty: the rig's own.
    """

    seed: int
    kind: Kind
    effects: tuple[tuple[str, str], ...] = ()
    removed: tuple[str, ...] = ()
    misfit: float = 6.0
    sharp: float = 0.5
    noise: Noise = "white"
    supply: bool = True
    few: bool = False
    poor: bool = False
    blemish: tuple[str, ...] = ()
    rig: str = JACK
    corrector: str = ""

    @property
    def id(self) -> str:
        """The name of its folder."""
        return f"{self.kind}-{self.seed}"


@dataclass(frozen=True)
class Scene:
    """All that a plan decides but its effects: the rig, its true numbers, its sensors' noise, what is played."""

    rig: Rig
    true: Mapping[str, float]
    sigma: Mapping[str, float]
    programme: Programme

    @property
    def played(self) -> tuple[Excitation, ...]:
        """Every record's excitation."""
        return self.programme.played

    @property
    def moving(self) -> tuple[Excitation, ...]:
        """Those that move the rig."""
        return self.played[self.programme.resting :]

    @property
    def base(self) -> Engine:
        """The rig as described."""
        return _engine(self.rig.name, self.rig.corrector, ())

    def misfit(self, p: np.ndarray, motions: Sequence[PlayedMotion]) -> Misfit:
        """What refits of the rig leave, with slopes along `motions` of plants with parameters p."""
        period, judging = self.played[0].period, self.programme.judging
        return Misfit(self.base, p, self.rig, self.sigma, motions, period, judging)

    def motions(
        self, mix: Mapping[Cause, Mapping[str, float]], played: Sequence[Excitation], heard: Sequence[np.ndarray] = ()
    ) -> list[PlayedMotion]:
        """Excitations played on the rig with these effects' numbers; `heard` [n] m is the noise of position, if any."""
        engine = _engine(self.rig.name, self.rig.corrector, tuple(cause.key for cause in mix))
        given = {cause.effect.key(name): value for cause, numbers in mix.items() for name, value in numbers.items()}
        p = engine.plant.parameter_values(None, **self.true, **given)
        states = dict(self.programme.start)
        for missing in mix:
            states |= missing.initial_states
        begin = start(engine, p, states, self.programme.balanced)
        loop, settings = self.programme.loop, self.programme.settings
        noises = heard or [np.zeros(len(excitation.reference)) for excitation in played]
        return [
            play(engine, p, begin, excitation, loop, noise, settings.get(excitation.name, {}))
            for excitation, noise in zip(played, noises, strict=True)
        ]


def draw(plan: CampaignPlan, folder: Path) -> dict[str, Any]:
    """Write the campaign's folder and return what it is short of. Raises InputError."""
    scene = _scene(plan)
    causes = [cause(*key, scene.rig) for key in plan.effects]
    strengths = _strengths(plan, scene, causes)
    loud = [_noises(plan, scene, number) for number in range(len(scene.played))]
    mix = {cause: strength.numbers for cause, strength in zip(causes, strengths, strict=True)}
    motions = scene.motions(mix, scene.played, [noises["position"] for noises in loud])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "campaign.toml").write_text(toml_text({"rig": plan.rig, **scene.programme.campaign}), encoding="utf-8")
    torn = int(_random(plan, "torn").integers(len(scene.played)))  # the record that loses rows, if any does
    for number, (excitation, motion, noises) in enumerate(zip(scene.played, motions, loud, strict=True)):
        settings = scene.programme.settings.get(excitation.name, {})
        recorded = {name: values for name, values in motion.inputs.items() if name not in settings}
        signals = {"t": excitation.t, "reference": excitation.reference, **recorded}
        for name in scene.sigma:
            signals[name] = quantised(motion.outputs[name] + noises[name], scene.rig, name, plan.noise)
        blemish = [what for what in plan.blemish if what != "drop" or number == torn]
        write(folder / f"{excitation.name}.csv.gz", signals, blemish, _random(plan, "blemish", number))
    return _truth(plan, scene, causes, strengths)


def planned_equations(plan: CampaignPlan) -> list[str]:
    """Equations in which a trace may rightly say that what the campaign lacks sits."""
    rig = _rig(plan.rig, plan.corrector)
    return list(dict.fromkeys(equation for key in plan.effects for equation in cause(*key, rig).equations))


def _scene(plan: CampaignPlan) -> Scene:
    rig = _rig(plan.rig, plan.corrector)
    drawn = _random(plan, "rig")
    true = {
        name: float(drawn.uniform(number.low, number.high))
        for name, number in rig.numbers.items()
        if number.low is not None and number.high is not None
    }
    excited = _random(plan, "excitation")
    run = programme(rig, excited, plan.sharp, plan.poor)
    sigma = sigmas(rig, plan.noise, _random(plan, "sensors"), run.readings)
    logged = [name for name in MEASURED if name in sigma and name != "force" and (name != "supply" or plan.supply)]
    names = [name for name in logged if name in FEW or not plan.few]
    scene = Scene(rig, true | _beside(plan, rig), {name: sigma[name] for name in names}, run)
    return _within_limits(scene)


def _within_limits(scene: Scene) -> Scene:
    """The scene with excitations so small that the rig stays within its stroke and no chamber falls below 0 bar."""
    for _ in range(TRIES):
        fits = [_fits(scene.rig, motion) for motion in scene.motions({}, scene.played)]
        if all(fits):
            return scene
        smaller = [
            excitation if fit else excitation.scaled(SMALLER)
            for excitation, fit in zip(scene.played, fits, strict=True)
        ]
        scene = replace(scene, programme=replace(scene.programme, played=tuple(smaller)))
    raise InputError(f"{scene.rig.name}: drawn excitations are too large at any size; check its limits")


def _fits(rig: Rig, motion: PlayedMotion) -> bool:
    travelled = np.abs(motion.outputs["position"] - rig["xmid"]).max()
    return travelled < rig.limit("stroke") and motion.outputs["lowest_pressure"].min() > 0


def _strengths(plan: CampaignPlan, scene: Scene, causes: Sequence[Cause]) -> list[Strength]:
    """Each effect alone as strong as the plan asks."""
    if not causes:
        return []
    p = scene.base.plant.parameter_values(None, **scene.true)
    plain = scene.misfit(p, scene.motions({}, scene.moving))
    return [
        _strength(plan, scene, cause, shaped(cause.effect, _random(plan, "shape", k)), plain)
        for k, cause in enumerate(causes)
    ]


def _strength(plan: CampaignPlan, scene: Scene, cause: Cause, shape: Mapping[str, float], plain: Misfit) -> Strength:
    """By slopes along the base motion first, then along that with the effect, where the refit ends: air in the oil
    moves resonances so far that only these say what a refit can do."""
    moving, misfit = scene.moving, plain
    strength = Strength({}, 1.0, np.inf)
    for _ in range(PASSES):
        strength = settle(
            lambda numbers, misfit=misfit: _heldout(scene, misfit, scene.motions({cause: numbers}, moving)),
            cause,
            shape,
            plan.misfit,
            strength.strength,
        )
        motions = scene.motions({cause: strength.numbers}, moving)
        misfit = scene.misfit(misfit.refit(motions).p, motions)
        left = misfit.refit(motions)
        strength = replace(strength, chi2=left.heldout, train=left.train)
        if abs(off(strength.chi2, plan.misfit)) < NEAR:
            break
    return strength


def _heldout(scene: Scene, misfit: Misfit, motions: Sequence[PlayedMotion]) -> float:
    """Chi2 that a refit leaves of held-out motions; infinite where the rig cannot go there."""
    if scene.programme.within and not all(_fits(scene.rig, motion) for motion in motions):
        return np.inf
    return misfit.refit(motions).heldout


def _noises(plan: CampaignPlan, scene: Scene, number: int) -> dict[str, np.ndarray]:
    """Noise [n] SI of every sensor in one record; the position's is there even where the loop alone reads it."""
    excitation, drawn = scene.played[number], _random(plan, "noise", number)
    averaged = scene.programme.readings > 1
    return {
        name: (0.0 if averaged and counts(scene.rig, name) else size)
        * noise(len(excitation.reference), excitation.period, plan.noise, drawn)
        for name, size in scene.sigma.items()
    }


def _truth(plan: CampaignPlan, scene: Scene, causes: Sequence[Cause], strengths: Sequence[Strength]) -> dict[str, Any]:
    """What the campaign is short of; keys as in truth.json, numbers in SI."""
    equations = list(dict.fromkeys(equation for cause in causes for equation in cause.equations))
    numbers = {c.effect.key(n): v for c, s in zip(causes, strengths, strict=True) for n, v in s.numbers.items()}
    shifts = {c.effect.shifts: s.numbers["by"] for c, s in zip(causes, strengths, strict=True) if c.effect.shifts}
    true = {name: value + shifts.get(name, 0.0) for name, value in scene.true.items()}
    return {
        "id": plan.id,
        "kind": plan.kind,
        "effects": [cause.effect.name for cause in causes],
        "formula": [cause.effect.formula for cause in causes],
        "equation": causes[0].effect.equation if causes else None,
        "equations": equations,
        "rig": plan.rig,
        "ratio": {name: value / scene.rig[name] for name, value in scene.true.items()},
        "true": true,
        "numbers": numbers,
        "strength": [strength.strength for strength in strengths],
        "expected": [strength.chi2 for strength in strengths],
        "expected_train": [strength.train for strength in strengths],
        "seed": plan.seed,
        "noise": plan.noise,
        "sigma": dict(scene.sigma),
        "sharp": plan.sharp,
        "supply": plan.supply,
        "few": plan.few,
        "poor": plan.poor,
        "blemish": list(plan.blemish),
        "removed": list(plan.removed),
        "goal": plan.misfit,
    }


def _random(plan: CampaignPlan, purpose: str, number: int = 0) -> np.random.Generator:
    """A stream of its own for every purpose: one more draw for one leaves the others as they were."""
    return np.random.default_rng([plan.seed, *purpose.encode(), number])


def _beside(plan: CampaignPlan, rig: Rig) -> dict[str, float]:
    """A wrong number is at the end of its range, beyond which it then is."""
    ends = {}
    for number in rig.numbers.values():
        for side, end in (("more", number.high), ("less", number.low)):
            if (f"number.{number.name}", side) in plan.effects and end is not None:
                ends[number.name] = end
    return ends


@lru_cache(maxsize=4)
def _rig(name: str, corrector: str) -> Rig:
    rig = load_rig(name)
    return rig.with_corrector(corrector) if corrector else rig


@lru_cache(maxsize=4)
def _engine(rig: str, corrector: str, causes: tuple[tuple[str, str], ...]) -> Engine:
    described = _rig(rig, corrector)
    return Engine(build(described, also=[cause(*key, described).effect for key in causes]), TOLERANCE)
