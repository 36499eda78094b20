"""A campaign whose rig is fitted, as a plan asks it: what it tells now of numbers and of the effects that may lack."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage
from ...identify.found.fitted import fitted_rig
from ...identify.plan.played import check
from ...identify.trace.information import EffectInformation, alternatives, effect_information, sharpened
from ...identify.trace.problem import EstimationProblem, estimation_problem
from ...identify.trace.record_gain import Pair, UnseenNumber, pairs, unseen_numbers, worth
from ...identify.trace.refit import FittedModel, fit_rig
from ...identify.trace.shortlist import score_effects, unpacked_shortlist
from ...identify.trace.stored import packed, unpacked
from ...identify.trace.workers import trace_workers
from ...plant.effects import Effect, applies
from ...records import Campaign, Record
from ...rigs.rig import Rig
from .metrics import Check

_PLAYED = 3  # records of a pair that are played with an effect on, until one splits it


@dataclass(frozen=True, eq=False)
class FittedCampaign:
    """A campaign whose rig is fitted, the rig as fitted, and the effects that this may be asked for."""

    problem: EstimationProblem
    model_fit: FittedModel
    rig: Rig
    library: tuple[Effect, ...]

    @property
    def misses(self) -> bool:
        """Whether the rig as fitted does not follow its records."""
        return self.problem.misses(self.model_fit.chi2, self.model_fit.samples)


@dataclass(frozen=True, eq=False)
class Told:
    """What a fitted campaign tells now, of numbers and of effects: its information [k + e, k + e]."""

    fitted: FittedCampaign
    effects: EffectInformation
    now: np.ndarray

    def expected(self, added: Mapping[str, np.ndarray]) -> "ExpectedInformation":
        """What is alike and not told, now and after records that add this information each."""
        fit, kappa = self.effects.model_fit.fit, self.fitted.problem.kappa
        alike, unseen = pairs(self.effects, self.now, added), unseen_numbers(fit, added, kappa)
        gains = {name: worth(name, alike, unseen, fit, sharpened(fit, more, kappa)) for name, more in added.items()}
        return ExpectedInformation(alike, unseen, gains)

    def played(self, pair: Pair, record: Record) -> dict[str, float]:
        """What a record says that was played with the first effect of a pair on."""
        return check(self.fitted.problem, self.effects, self.now, pair, record)


@dataclass(frozen=True)
class ExpectedInformation:
    """Pairs that look alike, numbers that are not told, and the information that each record adds on all, nats."""

    alike: Sequence[Pair]
    unseen: Sequence[UnseenNumber]
    gains: Mapping[str, float]

    def named(self, part: str) -> "ExpectedInformation":
        """What is expected, with names that begin with that of a part, "leg4."."""
        pairs = [replace(pair, names=(part + pair.names[0], part + pair.names[1])) for pair in self.alike]
        return ExpectedInformation(
            pairs, [replace(number, name=part + number.name) for number in self.unseen], self.gains
        )


def fitted_campaign(
    campaign: Campaign, rig: Rig, library: Sequence[Effect], stage: Stage, progress: Progress
) -> FittedCampaign:
    """Fit a rig to its campaign. Raises InputError where that cannot be fitted."""
    problem = estimation_problem(campaign, rig)
    if problem.large:
        problem = problem.only(stage("windows", problem.chosen))
    progress("fit of the rig's numbers")
    model_fit = unpacked(stage("base", lambda: packed(fit_rig(problem))), problem, ())
    able = tuple(effect for effect in library if applies(effect, rig))
    return FittedCampaign(problem, model_fit, fitted_rig(problem, model_fit), able)


def told(fitted: FittedCampaign, stage: Stage, progress: Progress) -> Told:
    """What a campaign tells now."""
    ranked = _ranked(fitted, stage, progress)
    effects = effect_information(fitted.problem, fitted.model_fit, alternatives(ranked, fitted.library))
    progress(f"{len(effects.candidates)} effects: what the campaign tells of them")
    now = stage("now", lambda: {"information": effects.of_fit(fitted.problem.train)})["information"]
    return Told(fitted, effects, now)


def _ranked(fitted: FittedCampaign, stage: Stage, progress: Progress) -> Sequence[Any]:
    """Effects with their scores, where something is missing; else nothing says how strong one would be."""
    if not fitted.misses:
        return ()
    progress("scores of the effects")
    problem, library = fitted.problem, fitted.library
    with trace_workers(1, problem, library, ()) as workers:
        stored = stage("scores", lambda: score_effects(workers, problem, fitted.model_fit, library, lambda _: None))
    return unpacked_shortlist(stored, library).ranked


def checks(
    alike: Sequence[Pair],
    gains: Mapping[str, float],
    played: Callable[[Pair, str], dict[str, float] | None],
    stage: Stage,
) -> dict[tuple[str, str], Check]:
    """For each pair the first of its records that splits it, `played` with the first effect on too."""
    found = {}
    for pair in alike:

        def compute(pair: Pair = pair) -> dict[str, Any]:
            for name in pair.helpful(gains)[:_PLAYED]:
                said = played(pair, name)
                if said is not None and pair.falls(said["cosine"]):
                    return {"record": name, "played": said}
            return {}

        if stored := stage(f"check-{'-'.join(pair.names)}", compute):
            found[pair.names] = Check(stored["record"], stored["played"])
    return found
