"""What a platform should move next: for each pair of effects that look alike in a leg, and each number of a leg that
the records do not tell, the motion of a family that splits or shows it best.

The legs are cut out by their load cells, and fitted; the motions are played by the platform as fitted, whose legs are
cut out again. A plan is for the legs that miss something, or for all six where none does. The payload is as its file
has it: records that ask for a plan are often too poor to fit one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage
from ...base.process_pool import one_blas_thread
from ...control.platform_controller import PlatformSpec
from ...identify.plan.motions import MOTIONS, MotionDesign, PlannedMotion
from ...identify.plan.platform_played import cut_run, planned_motion, played_again, with_effect_in
from ...identify.plan.played import windows_of
from ...identify.trace.record_gain import Pair, not_simulated
from ...identify.wrench.leg_cut import CutLeg
from ...loop.platform import PlatformRun, PlatformSetup, platform_setup
from ...loop.platform.excitation import drive_spec
from ...plant.effects import Effect
from ...records import Campaign, Record
from ...records.frequency_sheet import table_text
from ...report import Figure, Page
from ...rigs.platform import LEGS, Platform
from ..common.legs import of_leg
from ..common.outcome import Outcome
from ..fit.platform import with_found_legs
from ..trace.platform import leg_effects
from .fitted import Expected, FittedCampaign, Told, checks, fitted_campaign, told
from .metrics import Check, motion_wave, plan_metrics
from .platform_page import platform_page


@dataclass(frozen=True, eq=False)
class _Driven:
    """A platform with its drive."""

    setup: PlatformSetup
    spec: PlatformSpec

    @classmethod
    def of(cls, platform: Platform) -> "_Driven":
        setup = platform_setup(platform)
        return cls(setup, drive_spec(setup))


@dataclass(frozen=True, eq=False)
class _Legs:
    """The campaigns of six legs, fitted, and what those tell that a plan is for, by leg from 0."""

    fits: Sequence[FittedCampaign]
    told: Mapping[int, Told]

    def records(self, platform: Platform, run: PlatformRun, name: str) -> list[Record]:
        """A run of the platform as records of jacks."""
        return cut_run(platform, run, name, self.fits[0].problem.train.names)

    def information(self, records: Sequence[Record]) -> dict[str, np.ndarray]:
        """What the records of all legs [6] would add, by leg."""
        return {
            _name(leg): now.effects.of_further(windows_of(now.fitted.problem, records[leg]))
            for leg, now in self.told.items()
        }


def run_platform_plan(
    platform: Platform,
    whole: Sequence[Campaign],
    cut: Sequence[CutLeg],
    stage: Stage,
    progress: Progress,
    library: Sequence[Effect] | None = None,
    designs: Sequence[MotionDesign] = MOTIONS,
) -> Outcome:
    """Plan the next motions of a platform by its records, `whole` [6] and cut [6]; `library` are the effects to tell
    apart, else all that a leg may lack. Raises InputError where a leg cannot be fitted."""
    source = whole[0].path.resolve().name
    with one_blas_thread():
        legs = _legs(cut, library, stage, progress)
        progress("the platform as fitted, and its drive")
        found = with_found_legs(platform, [each.rig for each in legs.fits], source)
        motions, added = _expected(platform, found, legs, designs, stage, progress)
        expected = {leg: _named(leg, now.expected(added[_name(leg)])) for leg, now in legs.told.items()}
        gains = {name: sum(each.gains[name] for each in expected.values()) for name in motions}
        played = _checks(found, legs, expected, gains, motions, stage, progress)
    alike = sorted((pair for each in expected.values() for pair in each.alike), key=lambda pair: -pair.cosine)
    unseen = [number for each in expected.values() for number in each.unseen]
    metrics = plan_metrics(alike, unseen, gains, lambda name: motion_wave(motions[name]), played) | _of_legs(legs)
    candidates = {
        f"{_name(leg)}.{each.effect.name}": each for leg, now in legs.told.items() for each in now.effects.candidates
    }

    def draw() -> tuple[Page, Figure]:
        return platform_page(platform, whole, candidates, metrics, motions)

    files = {row["file"]: table_text(motions[row["record"]].columns()) for row in metrics["records"]}
    return Outcome(metrics, draw, files=files)


def _legs(
    cut: Sequence[CutLeg],
    library: Sequence[Effect] | None,
    stage: Stage,
    progress: Progress,
) -> _Legs:
    """Six legs fitted, and what those tell that miss something."""
    fits = []
    for leg, each in enumerate(cut):
        own = leg_effects(each.rig) if library is None else library
        fits.append(fitted_campaign(each.campaign, each.rig, own, *of_leg(stage, progress, leg + 1)))
    asked = [leg for leg, fitted in enumerate(fits) if fitted.misses] or range(LEGS)
    return _Legs(fits, {leg: told(fits[leg], *of_leg(stage, progress, leg + 1)) for leg in asked})


def _expected(
    platform: Platform, found: Platform, legs: _Legs, designs: Sequence[MotionDesign], stage: Stage, progress: Progress
) -> tuple[dict[str, PlannedMotion], dict[str, dict[str, np.ndarray]]]:
    """The motions that the platform takes, and what each would add, by leg and motion."""
    driven, declared = _Driven.of(found), platform_setup(platform)
    motions: dict[str, PlannedMotion] = {}
    added: dict[str, dict[str, np.ndarray]] = {_name(leg): {} for leg in legs.told}
    for design in designs:

        def compute(design: MotionDesign = design) -> dict[str, Any]:
            planned = planned_motion(driven.setup, driven.spec, declared, design)
            if planned is None:
                return {}
            motion, run = planned
            return {"size": motion.size, **legs.information(legs.records(found, run, design.name))}

        progress(f"{design.name}: in simulation")
        if stored := stage(f"motion-{design.name}", compute):
            motions[design.name] = PlannedMotion.sized(design, found, stored["size"])
            for leg, own in added.items():
                own[design.name] = stored[leg]
    return motions, added


def _checks(
    found: Platform,
    legs: _Legs,
    expected: Mapping[int, Expected],
    gains: Mapping[str, float],
    motions: Mapping[str, PlannedMotion],
    stage: Stage,
    progress: Progress,
) -> dict[tuple[str, str], Check]:
    """For each pair the first of its motions that splits it, played with the first effect on in its leg too."""
    made: dict[str, _Driven] = {}

    def driven(leg: int, pair: Pair) -> _Driven:
        if pair.names[0] not in made:
            candidate = legs.told[leg].effects.candidates[pair.places[0]]
            made[pair.names[0]] = _Driven.of(with_effect_in(found, leg, candidate))
        return made[pair.names[0]]

    def of_leg(leg: int, pair: Pair, name: str) -> dict[str, float] | None:
        progress(f"{name} with {pair.names[0]} on")
        affected = driven(leg, pair)
        run = played_again(affected.setup, affected.spec, motions[name])
        return run and legs.told[leg].played(pair, legs.records(found, run, name)[leg])

    return {
        names: check
        for leg, each in expected.items()
        for names, check in checks(each.alike, gains, partial(of_leg, leg), stage).items()
    }


def _named(leg: int, expected: Expected) -> Expected:
    """With the leg in the names."""
    own = _name(leg)
    pairs = [replace(pair, names=(f"{own}.{pair.names[0]}", f"{own}.{pair.names[1]}")) for pair in expected.alike]
    numbers = [replace(number, name=f"{own}.{number.name}") for number in expected.unseen]
    return Expected(pairs, numbers, expected.gains)


def _of_legs(legs: _Legs) -> dict[str, Any]:
    """What metrics.json says of legs: effects that could not be compared, and whether each follows its records."""
    rows = [
        {"leg": leg + 1, "chi2": each.model_fit.chi2, "follows": not each.misses, "planned": leg in legs.told}
        for leg, each in enumerate(legs.fits)
    ]
    left_out = [
        f"{_name(leg)}.{name}" for leg, now in legs.told.items() for name in not_simulated(now.effects, now.now)
    ]
    return {"not_compared": left_out, "legs": rows}


def _name(leg: int) -> str:
    return f"leg{leg + 1}"
