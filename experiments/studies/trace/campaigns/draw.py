"""Drawn campaigns: recordings of a rig whose numbers, noise, excitation and missing effect a seed decides.

    truth = draw(Case(seed=7, kind="single", effects=(("jack.friction", "stribeck"),)), Path("c007"))

The folder holds what a bench would leave, and nothing that gives the answer away; the answer is what `draw` returns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np

from workbench.base.signals import MEASURED
from workbench.base.toml_text import toml_text
from workbench.identify.trace.problem import estimation_problem
from workbench.records import load_campaign
from workbench.records.campaign import FREE_RUN
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import save_rig
from workbench.rigs.shipped import bundled

from .cause import Cause, cause
from .misfit import Misfit
from .noise import Noise, counts, noise, quantised, sigmas, write
from .play import PlayedMotion
from .programme import programme
from .scene import Scene, drawn_rig, fits, within_limits
from .strength import Strength, off, settle, shaped

JACK = "jack-10t"
FEW = {"second-order": ("pa", "position")}  # where sensors are missing, by the valve
FEW_ELSE = ("current", "pa", "pb", "position")
WIDE = 20.0  # beyond this factor a range is drawn from by its logarithm
PASSES, NEAR = 3, 0.3  # of the search for a strength; of log(chi2 - 1)

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


def draw(plan: CampaignPlan, folder: Path) -> dict[str, Any]:
    """Write the campaign's folder and return what it is short of. Raises InputError."""
    scene = _scene(plan)
    causes = [cause(*key, scene.rig) for key in plan.effects]
    strengths = _strengths(plan, scene, causes)
    loud = [_noises(plan, scene, number) for number in range(len(scene.played))]
    mix = {cause: strength.numbers for cause, strength in zip(causes, strengths, strict=True)}
    motions = scene.motions(mix, scene.played, _heard(scene, loud))
    _record(plan, scene, motions, loud, folder)
    return _truth(plan, scene, causes, strengths)


def written_records(
    plan: CampaignPlan,
    scene: Scene,
    numbers: Mapping[str, float],
    mix: Mapping[Cause, Mapping[str, float]],
    louder: float,
    folder: Path,
    extra: Mapping[str, Any],
) -> None:
    """A campaign folder of a scene whose rig has other true `numbers`, effects with theirs, and `louder` sensors;
    `extra` are further keys of its campaign.toml."""
    programme = replace(scene.programme, campaign={**scene.programme.campaign, **extra})
    sigma = {name: louder * size for name, size in scene.sigma.items()}
    other = replace(scene, true=numbers, sigma=sigma, programme=programme)
    loud = [_noises(plan, other, number) for number in range(len(other.played))]
    _record(plan, other, other.motions(mix, other.played, _heard(other, loud)), loud, folder)


def drawn_scene(plan: CampaignPlan) -> Scene:
    """The scene of a plan: a rig with true numbers, its sensors, and what is played."""
    return _scene(plan)


def _record(
    plan: CampaignPlan,
    scene: Scene,
    motions: Sequence[PlayedMotion],
    loud: Sequence[Mapping[str, np.ndarray]],
    folder: Path,
) -> None:
    """Leave a campaign's folder: what the sensors say of motions with noise."""
    folder.mkdir(parents=True, exist_ok=True)
    own = plan.rig not in bundled()
    rig = "rig.toml" if own else plan.rig
    (folder / "campaign.toml").write_text(toml_text({"rig": rig, **scene.programme.campaign}), encoding="utf-8")
    if own:
        save_rig(scene.rig, folder / rig)
    torn = int(_random(plan, "torn").integers(len(scene.played)))  # the record that loses rows, if any does
    for number, (excitation, motion, noises) in enumerate(zip(scene.played, motions, loud, strict=True)):
        settings = scene.programme.settings.get(excitation.name, {})
        recorded = {name: values for name, values in motion.inputs.items() if name not in settings}
        signals = {"t": excitation.t, "reference": excitation.reference, **recorded}
        for name in scene.sigma:
            signals[name] = quantised(motion.outputs[name] + noises[name], scene.rig, name, plan.noise)
        blemish = [what for what in plan.blemish if what != "drop" or number == torn]
        write(folder / f"{excitation.name}.csv.gz", signals, blemish, _random(plan, "blemish", number))


def planned_equations(plan: CampaignPlan) -> list[str]:
    """Equations in which a trace may rightly say that what the campaign lacks sits."""
    rig = drawn_rig(plan.rig, plan.corrector)
    return list(dict.fromkeys(equation for key in plan.effects for equation in cause(*key, rig).equations))


def _scene(plan: CampaignPlan) -> Scene:
    rig = drawn_rig(plan.rig, plan.corrector)
    drawn = _random(plan, "rig")
    true = {
        name: _within(drawn, number.low, number.high)
        for name, number in rig.numbers.items()
        if number.low is not None and number.high is not None
    }
    excited = _random(plan, "excitation")
    run = programme(rig, excited, plan.sharp, plan.poor)
    sigma = sigmas(rig, plan.noise, _random(plan, "sensors"), run.readings)
    left = {"force": not rig.cell_is_idle, "supply": plan.supply}
    few = FEW.get(rig.valve, FEW_ELSE) if plan.few else MEASURED
    names = [name for name in MEASURED if name in sigma and name in few and left.get(name, True)]
    scene = Scene(rig, true | _beside(plan, rig), {name: sigma[name] for name in names}, run)
    scene = within_limits(scene)
    free_runs = run.campaign.get("score") == FREE_RUN
    return replace(scene, judged=_free_run_floor(plan, scene)) if free_runs and plan.effects else scene


def _within(drawn: np.random.Generator, low: float, high: float) -> float:
    by_factor = 0 < WIDE * low < high
    return float(np.exp(drawn.uniform(np.log(low), np.log(high))) if by_factor else drawn.uniform(low, high))


def _free_run_floor(plan: CampaignPlan, scene: Scene) -> dict[str, float]:
    """What errors [SI] of free runs are held against, by records of the rig with its true numbers."""
    loud = [_noises(plan, scene, number) for number in range(len(scene.played))]
    motions = scene.motions({}, scene.played, _heard(scene, loud))
    with TemporaryDirectory() as scratch:
        _record(plan, scene, motions, loud, Path(scratch))
        floor = estimation_problem(load_campaign(scratch), scene.rig.with_values(**scene.true)).floor
    return {name: floor.sigma[name] for name in scene.sigma}


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
    if scene.programme.within and not all(fits(scene.rig, motion) for motion in motions):
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


def _heard(scene: Scene, loud: Sequence[Mapping[str, np.ndarray]]) -> list[np.ndarray]:
    """The noise [n] m of position that the loop hears in every record."""
    deaf = scene.programme.resting if scene.programme.still else 0
    return [noises["position"] * (number >= deaf) for number, noises in enumerate(loud)]


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
        "ratio": {name: value / scene.rig[name] for name, value in scene.true.items() if scene.rig[name]},
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
