"""What a platform should move next: for each pair of effects that look alike in a leg, and each number of a leg that
the records do not tell, the motion of a family that splits or shows it best.

The legs are cut out by their load cells, and fitted; the motions are played by the platform as fitted, whose legs are
cut out again. A plan is for the legs that miss something, or for all six where none does. The payload is as its file
has it: records that ask for a plan are often too poor to fit one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from ...base.checkpoint import Progress, Stage
from ...base.process_pool import one_blas_thread
from ...control.platform_controller import PlatformSpec
from ...identify.fit.free_parameters import Candidate
from ...identify.plan.motions import MOTIONS, MotionDesign, PlannedMotion
from ...identify.plan.platform_played import cut_run, planned_motion, played_again, with_effect_in
from ...identify.wrench.leg_cut import CutLeg
from ...loop.platform import PlatformRun, PlatformSetup, platform_setup
from ...loop.platform.excitation import drive_spec
from ...plant.effects import Effect
from ...records import Campaign
from ...report import Figure, Page
from ...rigs.platform import LEGS, Platform
from ..common.legs import each_leg, of_leg
from ..common.outcome import Outcome
from ..fit.platform import with_found_legs
from ..trace.platform import leg_effects
from .fitted import FittedCampaign, fitted_campaign, told
from .platform_page import platform_page
from .study import Kept, Logs, planned_next, wave_files


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

    def fitted(leg: CutLeg, stage: Stage, progress: Progress) -> FittedCampaign:
        own = leg_effects(leg.rig) if library is None else library
        return fitted_campaign(leg.campaign, leg.rig, own, stage, progress)

    with one_blas_thread():
        fits = each_leg(cut, stage, progress, fitted)
        asked = [leg for leg, fitted in enumerate(fits) if fitted.misses] or range(LEGS)
        parts = {_name(leg): told(fits[leg], *of_leg(stage, progress, leg + 1)) for leg in asked}
        progress("the platform as fitted, and its drive")
        found = with_found_legs(platform, [each.rig for each in fits], whole[0].path.resolve().name)
        family = {design.name: design for design in designs}
        player = _PlatformPlayer(platform_setup(platform), found, found, fits[0].problem.train.names, family)
        metrics, motions = planned_next(parts, family, player, stage, progress)
    metrics["legs"] = [
        {"leg": leg + 1, "chi2": each.model_fit.chi2, "follows": not each.misses, "planned": _name(leg) in parts}
        for leg, each in enumerate(fits)
    ]
    candidates = {part + each.effect.name: each for part, now in parts.items() for each in now.effects.candidates}

    def draw() -> tuple[Page, Figure]:
        return platform_page(platform, whole, candidates, metrics, motions)

    return Outcome(metrics, draw, files=wave_files(metrics, motions))


@dataclass(frozen=True, eq=False)
class _PlatformPlayer:
    """A platform that plays with its drive, as it is `found` or with an effect, within the limits of the one that is
    `declared` too; its legs log the signals `names`, cut out as those of the found one. The `family` has motions by
    name."""

    declared: PlatformSetup
    found: Platform
    plays: Platform
    names: tuple[str, ...]
    family: Mapping[str, MotionDesign]

    @cached_property
    def setup(self) -> PlatformSetup:
        return platform_setup(self.plays)

    @cached_property
    def spec(self) -> PlatformSpec:
        return drive_spec(self.setup)

    def takes(self, name: str) -> tuple[Kept, Logs] | None:
        planned = planned_motion(self.setup, self.spec, self.declared, self.family[name])
        if planned is None:
            return None
        motion, run = planned
        return {"size": motion.size}, self._cut(run, name)

    def made(self, name: str, kept: Kept) -> PlannedMotion:
        return PlannedMotion.sized(self.family[name], self.found, kept["size"])

    def affected(self, part: str, candidate: Candidate) -> "_PlatformPlayer":
        leg = next(leg for leg in range(LEGS) if _name(leg) == part)
        return replace(self, plays=with_effect_in(self.found, leg, candidate))

    def log(self, wave: PlannedMotion) -> Logs | None:
        run = played_again(self.setup, self.spec, wave)
        return None if run is None else self._cut(run, wave.design.name)

    def _cut(self, run: PlatformRun, name: str) -> Logs:
        return {_name(leg): record for leg, record in enumerate(cut_run(self.found, run, name, self.names))}


def _name(leg: int) -> str:
    """What the names of a leg, counted from 0, begin with."""
    return f"leg{leg + 1}."
