"""Records that do not exist yet: an excitation played by the drive of a rig as fitted, as windows of a campaign."""

from dataclasses import replace

import numpy as np

from ...loop.drive_simulation import DriveSimulation, play
from ...plant import build
from ...plant.effects.declared import effect_use
from ...records import Record
from ...records.excitation import Excitation
from ...rigs.rig import Rig
from ..fit.free_parameters import Candidate
from ..fit.windows import Windows, cut_windows
from ..trace.information import EffectInformation, cosines, effects_alone
from ..trace.problem import EstimationProblem
from ..trace.record_gain import Pair


def simulated(drive: DriveSimulation, excitation: Excitation, names: tuple[str, ...]) -> Record | None:
    """The record without noise, with the signals `names` that the campaign compares; None where the rig trips."""
    run = play(drive, excitation)
    if run.tripped is not None:
        return None
    signals = {name: run.record.signals[name] for name in ("command", *names)}
    return Record(excitation.name, run.record.t, signals)


def windows_of(problem: EstimationProblem, record: Record) -> Windows:
    """The windows of a further record, compared as the campaign's are."""
    campaign = problem.campaign
    beside = (*campaign.train, *campaign.select, *campaign.heldout)
    return cut_windows(build(problem.rig), [record], problem.floor, beside=beside)


def with_effect(rig: Rig, candidate: Candidate) -> Rig:
    """The rig with an effect at the strength that it is compared at."""
    use = effect_use(candidate.effect, candidate.start, "assumed, to tell it from others")
    return replace(rig, effects=(*rig.effects, use))


def check(
    problem: EstimationProblem,
    effects: EffectInformation,
    now: np.ndarray,
    pair: Pair,
    record: Record,
) -> dict[str, float]:
    """The check of a record played with a pair's first effect on: the cosine with what was recorded then, and which
    share of what the rig alone misses each effect explains."""
    first, second = pair.places
    fit, count = effects.model_fit.fit, len(effects.candidates)
    k = len(fit.free)
    missed, sign = [*range(k + count), k + first], np.ones(k + count + 1)
    sign[-1] = -1.0  # what the campaign would have missed: a prediction without the first effect, less one with it
    information = now[np.ix_(missed, missed)] * np.outer(sign, sign) + effects.of_further(
        windows_of(problem, record), errors=True
    )
    part = [first, second, count]
    likeness = cosines(effects_alone(information, fit)[np.ix_(part, part)])
    shares = {name: float(likeness[place, 2] ** 2) for place, name in enumerate(pair.names)}
    return {"cosine": float(likeness[0, 1]), **shares}
