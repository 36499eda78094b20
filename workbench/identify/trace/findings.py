"""What a trace finds: effects that were tried and what the rule said of them, pass by pass, and the answer."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...plant.effects import Effect
from ..fit.free_parameters import Candidate
from .localise import clear_evidence, likely_equations
from .problem import EstimationProblem
from .refit import FittedModel, HeldoutErrors
from .rule import PARTIAL, Judgement
from .told import ToldEffects


@dataclass(frozen=True, eq=False)
class CandidateFit:
    """A refitted effect and what the rule says of it; `failed` says why there is no fit.

    `tied` are names that explain as much in the same pass, best first.
    """

    candidate: Candidate
    score: float
    judgement: Judgement
    model_fit: FittedModel | None
    failed: str = ""
    tied: tuple[str, ...] = ()

    @property
    def refitted(self) -> FittedModel:
        """The refitted model. Raises ValueError where there is none."""
        if self.model_fit is None:
            raise ValueError(f"{self.judgement.name} {self.judgement.formula} has no fit: {self.failed}")
        return self.model_fit


@dataclass(frozen=True, eq=False)
class Pass:
    """One search for an effect: shortlist with scores (share of the misfit) and cosines, and what was refitted.

    `pairs` are the shortlist of two effects at once, with the share of the misfit. Not `finished`: the time was over
    before all was refitted that it would have been.
    """

    before: FittedModel
    scores: tuple[tuple[Candidate, float], ...]
    compared: tuple[str, ...]
    cosines: np.ndarray
    pairs: tuple[tuple[tuple[Candidate, Candidate], float], ...]
    tried: tuple[CandidateFit, ...]
    accepted: tuple[CandidateFit, ...]
    finished: bool = True


def partial_effect(of: Pass) -> CandidateFit | None:
    """The effect that passes and explains most of what was left before a pass, if that is PARTIAL of it at least."""
    able = [fit for fit in of.tried if fit.judgement.passes and fit.judgement.explained >= PARTIAL]
    return able[0] if able else None


@dataclass(frozen=True)
class LearnedShape:
    """What was learned of an effect's shape, or beside all effects: the effect with it, the formula's last `words`, and
    chi2 of the held-out records with it."""

    effect: Effect
    words: str
    chi2: float


@dataclass(frozen=True, eq=False)
class Trace:
    """What a trace found. `effects` were added, in order.

    `named` is the fit with them, `final` that with what was `learned` of their shape, or of an unknown, on top.
    `heldout` are the errors of `base`, `named` and `final` on the held-out records. `refuted` are effects that
    explained what was selected by, but not the held-out records, of which they left `refuted_errors`: nothing is named.
    `evidence`: gain in log-likelihood of a disturbance in each equation, most first; `parity_residuals`: chi2 of the
    equations that measured signals test by themselves. Both are empty where chi2 is at the floor. `by_numbers`: what
    the named effects leave of the held-out records is gone once their numbers are fitted to these too. `several`: the
    rig is known to lack more than one. Not `finished`: the time for the search was over before all was tried.
    `candidates`: how many effects and numbers it chose from. `told`: of a closed loop, which effects its records show.
    """

    problem: EstimationProblem
    base: FittedModel
    named: FittedModel
    final: FittedModel
    heldout: tuple[HeldoutErrors, HeldoutErrors, HeldoutErrors]
    verdict: str
    effects: tuple[CandidateFit, ...]
    equation: str | None
    evidence: tuple[tuple[str, float], ...]
    parity_residuals: Mapping[str, float]
    passes: tuple[Pass, ...]
    refuted: tuple[CandidateFit, ...] = ()
    refuted_errors: HeldoutErrors | None = None
    learned: tuple[LearnedShape, ...] = ()
    by_numbers: bool = False
    several: bool = False
    finished: bool = True
    candidates: int = 1
    told: ToldEffects | None = None

    @property
    def tied(self) -> tuple[str, ...]:
        """Names that were not added and explain as much as an effect that was."""
        added = [fit.candidate.effect.name for fit in self.effects]
        return tuple(dict.fromkeys(name for fit in self.effects for name in fit.tied if name not in added))

    @property
    def chi2(self) -> tuple[float, float]:
        """Before and after, on held-out records."""
        return self.heldout[0].chi2, self.heldout[-1].chi2

    @property
    def equations(self) -> list[str]:
        """Equations that the residual may sit in: `equation`, and those that evidence does not put clearly behind."""
        if self.equation is None:
            return []
        likely = likely_equations(self.evidence, self.parity_residuals, self.clear)
        return list(dict.fromkeys((self.equation, *likely)))

    @property
    def clear(self) -> float:
        """The evidence from which on an equation is told apart from another."""
        return clear_evidence(self.evidence, self.problem.kappa)

    @property
    def left(self) -> float:
        """What named effects leave of the held-out records that noise would not, of the noise's variance; else 0."""
        named = self.heldout[1]
        return named.chi2 - 1 if self.problem.misses(named.chi2, named.samples) else 0.0

    @property
    def at_floor(self) -> bool:
        """Whether the held-out records show nothing missing from the last fit."""
        after = self.heldout[-1]
        return not self.problem.misses(after.chi2, after.samples)
