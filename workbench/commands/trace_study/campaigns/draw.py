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
from .excitation import excitations, loop_gain
from .misfit import Misfit
from .noise import Noise, noise, quantised, sigmas, write
from .play import PlayedMotion, play, start
from .strength import Strength, off, settle, shaped

RIG = "jack-10t"
ROLES = {"static": ["static.csv.gz"], "train": ["steps.csv.gz", "triangle.csv.gz"], "heldout": ["multisine.csv.gz"]}
FEW = ("current", "pa", "pb", "position")  # where sensors are missing
TOLERANCE = 1e-6  # of the simulation: far below what a fit resolves
PASSES, NEAR = 3, 0.3  # of the search for a strength; of log(chi2 - 1)
SMALLER, TRIES = 0.8, 8  # where a drawn excitation is too much for the rig

Kind = Literal["single", "pair", "off", "clean"]


@dataclass(frozen=True)
class CampaignPlan:
    """A campaign to draw; whatever is not said here follows from the seed.

    effects: name and formula of each, see foreign.py. removed: names that the tracer's library is to be without.
    misfit: the held-out chi2 that a refit of the base model should leave. sharp: how fast the command is, up to 1.
    few: no spool, acceleration and supply sensors. poor: hardly any excitation.
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

    @property
    def id(self) -> str:
        """The name of its folder."""
        return f"{self.kind}-{self.seed}"


@dataclass(frozen=True)
class Scene:
    """All that a case decides but its effects: the rig, its true numbers, its sensors' noise, what is played."""

    rig: Rig
    true: Mapping[str, float]
    sigma: Mapping[str, float]
    gain: float
    played: tuple[Excitation, ...]

    def motions(
        self, mix: Mapping[Cause, Mapping[str, float]], played: Sequence[Excitation], heard: Sequence[np.ndarray] = ()
    ) -> list[PlayedMotion]:
        """Excitations played on the rig with these effects' numbers; `heard` [n] m is the noise of position, if any."""
        engine = _engine(tuple(cause.key for cause in mix))
        given = {cause.effect.key(name): value for cause, numbers in mix.items() for name, value in numbers.items()}
        p = engine.plant.parameter_values(None, **self.true, **given)
        begin = start(engine, p, {name: value for cause in mix for name, value in cause.initial_states.items()})
        noises = heard or [np.zeros(len(excitation.reference)) for excitation in played]
        return [
            play(engine, p, begin, excitation, self.gain, noise)
            for excitation, noise in zip(played, noises, strict=True)
        ]


def draw(plan: CampaignPlan, folder: Path) -> dict[str, Any]:
    """Write the campaign's folder and return what it is short of. Raises InputError."""
    scene, causes = _scene(plan), [cause(*key) for key in plan.effects]
    strengths = _strengths(plan, scene, causes)
    loud = [_noises(plan, scene, number) for number in range(len(scene.played))]
    mix = {cause: strength.numbers for cause, strength in zip(causes, strengths, strict=True)}
    motions = scene.motions(mix, scene.played, [noises["position"] for noises in loud])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "campaign.toml").write_text(toml_text({"rig": RIG, "records": ROLES}), encoding="utf-8")
    torn = int(_random(plan, "torn").integers(len(scene.played)))  # the record that loses rows, if any does
    for number, (excitation, motion, noises) in enumerate(zip(scene.played, motions, loud, strict=True)):
        signals = {"t": excitation.t, "reference": excitation.reference, "command": motion.command}
        for name in scene.sigma:
            signals[name] = quantised(motion.outputs[name] + noises[name], scene.rig, name, plan.noise)
        blemish = [what for what in plan.blemish if what != "drop" or number == torn]
        write(folder / f"{excitation.name}.csv.gz", signals, blemish, _random(plan, "blemish", number))
    return _truth(plan, scene, causes, strengths)


def _scene(plan: CampaignPlan) -> Scene:
    rig = _rig()
    drawn = _random(plan, "rig")
    true = {
        name: float(drawn.uniform(number.low, number.high))
        for name, number in rig.numbers.items()
        if number.low is not None and number.high is not None
    }
    sigma = sigmas(rig, plan.noise, _random(plan, "sensors"))
    logged = [name for name in MEASURED if name in sigma and name != "force" and (name != "supply" or plan.supply)]
    names = [name for name in logged if name in FEW or not plan.few]
    excited = _random(plan, "excitation")
    gain = loop_gain(rig, excited)
    played = excitations(rig, excited, plan.sharp, plan.poor)
    scene = Scene(rig, true, {name: sigma[name] for name in names}, gain, played)
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
        scene = replace(scene, played=tuple(smaller))
    raise InputError(f"{scene.rig.name}: drawn excitations are too large at any size; check its limits")


def _fits(rig: Rig, motion: PlayedMotion) -> bool:
    travelled = np.abs(motion.outputs["position"] - rig["xmid"]).max()
    return travelled < rig.limit("stroke") and motion.outputs["lowest_pressure"].min() > 0


def _strengths(plan: CampaignPlan, scene: Scene, causes: Sequence[Cause]) -> list[Strength]:
    """Each effect alone as strong as the plan asks."""
    if not causes:
        return []
    base, moving = _engine(()), scene.played[1:]
    p = base.plant.parameter_values(None, **scene.true)
    plain = Misfit(base, p, scene.rig, scene.sigma, scene.motions({}, moving))
    return [
        _strength(plan, scene, cause, shaped(cause.effect, _random(plan, "shape", k)), plain)
        for k, cause in enumerate(causes)
    ]


def _strength(plan: CampaignPlan, scene: Scene, cause: Cause, shape: Mapping[str, float], plain: Misfit) -> Strength:
    """By slopes along the base motion first, then along that with the effect, where the refit ends: air in the oil
    moves resonances so far that only these say what a refit can do."""
    base, moving, misfit = _engine(()), scene.played[1:], plain
    strength = Strength({}, 1.0, np.inf)
    for _ in range(PASSES):
        strength = settle(
            lambda numbers, misfit=misfit: misfit.refit(scene.motions({cause: numbers}, moving)).heldout,
            cause,
            shape,
            plan.misfit,
            strength.strength,
        )
        motions = scene.motions({cause: strength.numbers}, moving)
        misfit = Misfit(base, misfit.refit(motions).p, scene.rig, scene.sigma, motions)
        left = misfit.refit(motions)
        strength = replace(strength, chi2=left.heldout, train=left.train)
        if abs(off(strength.chi2, plan.misfit)) < NEAR:
            break
    return strength


def _noises(plan: CampaignPlan, scene: Scene, number: int) -> dict[str, np.ndarray]:
    """Noise [n] SI of every sensor in one record; the position's is there even where the loop alone reads it."""
    excitation, drawn = scene.played[number], _random(plan, "noise", number)
    return {
        n: s * noise(len(excitation.reference), excitation.period, plan.noise, drawn) for n, s in scene.sigma.items()
    }


def _truth(plan: CampaignPlan, scene: Scene, causes: Sequence[Cause], strengths: Sequence[Strength]) -> dict[str, Any]:
    """What the campaign is short of; keys as in truth.json, numbers in SI."""
    equations = list(dict.fromkeys(equation for cause in causes for equation in cause.equations))
    numbers = {c.effect.key(n): v for c, s in zip(causes, strengths, strict=True) for n, v in s.numbers.items()}
    return {
        "id": plan.id,
        "kind": plan.kind,
        "effects": [cause.effect.name for cause in causes],
        "formula": [cause.effect.formula for cause in causes],
        "equation": causes[0].effect.equation if causes else None,
        "equations": equations,
        "ratio": {name: value / scene.rig[name] for name, value in scene.true.items()},
        "true": dict(scene.true),
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


@lru_cache(maxsize=1)
def _rig() -> Rig:
    return load_rig(RIG)


@lru_cache(maxsize=4)
def _engine(causes: tuple[tuple[str, str], ...]) -> Engine:
    return Engine(build(_rig(), also=[cause(*key).effect for key in causes]), TOLERANCE)
