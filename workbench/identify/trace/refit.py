"""The fits of a trace: the rig alone, and with effects added, each compared by what it did not see."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...plant.effects import Effect
from ..fit.free_parameters import Candidate, at_strength
from ..fit.initial_states import free_runs, predicted_states
from ..fit.model import Model
from ..fit.normal_equations import numbers_at
from ..fit.rests import growing_pole
from ..fit.rotation import Selection
from ..fit.solver import Fit, fit_numbers
from ..fit.unexplained import unexplained_signals
from ..fit.windows import Windows
from . import rule as decide
from .follow import Follower, Start
from .problem import EstimationProblem
from .short_windows import fit_short_windows_first

_MORE = 2  # places from which a loop that came out unstable is fitted again
_REFIT_ROUNDS = 12
_WEAKER = (1.0, 0.5, 0.25, 0.1, 0.03)  # of the strength to start from
_NEAR = (1.0, 0.5, 0.25)  # of that strength: where one with memory that harms at each is sought in short windows
_GONE = 1e-4  # of the typical strength
_FAINT = 0.1  # of the typical strength
_ELSEWHERE = 0.3  # where a second start puts a number that shapes an effect, over where the first had it


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A model that was fitted: `known` are the effects added to the rig, with the numbers they started at.

    `selection` are its squared errors on what it is compared by with other models (see problem.py).
    """

    known: tuple[Candidate, ...]
    model: Model
    fit: Fit
    selection: Selection

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects alone."""
        return tuple(candidate.effect for candidate in self.known)

    @property
    def squares(self) -> float:
        """All squared errors over sigma of the selection; infinite where a window failed."""
        return float(self.selection.squares.sum())

    @property
    def samples(self) -> int:
        """Samples of the selection."""
        return self.selection.samples

    @property
    def chi2(self) -> float:
        """Squared errors of the selection over its samples."""
        return self.squares / self.samples


@dataclass(frozen=True, eq=False)
class HeldoutErrors:
    """Squared errors [windows] of the held-out records, of `samples` in all, from the initial states x0 [windows, n]
    that fit them best."""

    x0: np.ndarray
    squares: np.ndarray
    samples: int

    @property
    def chi2(self) -> float:
        """Squared errors over samples; infinite where a window failed."""
        return float(self.squares.sum()) / self.samples

    def explained(self, after: "HeldoutErrors") -> float:
        """The share of the misfit that is gone `after`."""
        return decide.explained(float(self.squares.sum()), float(after.squares.sum()), self.samples)


def fit_rig(
    problem: EstimationProblem,
    starts: int = 1,
    report_progress: Callable[[str], None] = lambda _: None,
    follows: bool = True,
) -> FittedModel:
    """Fit the rig's uncertain numbers: from what it declares, then from random places in the ranges; the best.

    Free runs are fitted in blocks first, from which whole records are in reach; those from rest need none. `follows`:
    whether a rig that does not follow its records is refused; see `check_follows`. A rig whose inner loop is found
    unstable, as no loop is that came to rest, is fitted from _MORE further places, and a stable one is better.
    """
    if not problem.free_run or problem.train.from_rest:
        return _fit_from(problem, starts, report_progress, follows)
    return refit_all_windows(problem, _fit_from(problem.in_blocks(), starts, report_progress, follows))


def check_follows(problem: EstimationProblem, model_fit: FittedModel) -> None:
    """Raises InputError where a fit is no nearer to the train records than constants: they are not of this rig then,
    or misread, unless an effect that the rig lacks explains them."""
    fit = model_fit.fit
    if lost := unexplained_signals(model_fit.model, problem.train, fit.x0, fit.p):
        raise _lost(problem, lost)


def _fit_from(
    problem: EstimationProblem, starts: int, report_progress: Callable[[str], None], follows: bool
) -> FittedModel:
    free, model = problem.free, problem.model()
    random = np.random.default_rng(0)
    best, lost, grows, start = None, ["any signal"], None, 0
    while start < starts or (grows and start < starts + _MORE):
        x = np.zeros(len(free)) if start == 0 else random.uniform(-0.7, 0.7, len(free))
        p = model.p
        guess = model.starts(problem.train, p)
        fit = fit_numbers(model, problem.train, free, x, p, guess, problem.kappas)
        pole = growing_pole(model, fit.p) if problem.rig.inner and fit.ok else None
        rank = pole is not None, fit.squares.sum()
        if fit.ok and (best is None or rank < (grows is not None, best.squares.sum())):
            best, grows = fit, pole
            lost = unexplained_signals(model, problem.train, fit.x0, fit.p) if follows else []
        if best is not None and not lost:  # no progress line before it is clear that the input is not refused
            how = ", unstable" if pole else ""
            report_progress(f"start {start + 1}: chi2 {fit.chi2:.4g} on the train records{how}")
        start += 1
    if best is None or lost:
        raise _lost(problem, lost)
    return with_selection(problem, model, best, ())


def _lost(problem: EstimationProblem, names: Sequence[str]) -> InputError:
    return InputError(
        f"{problem.campaign.path}: {problem.rig.name}, fitted, is no nearer to {', '.join(names)} than a constant "
        "would be; check units and signs, and whether the records are this rig's"
    )


def refit(
    problem: EstimationProblem, model_fit: FittedModel, candidate: Candidate, again: bool = False, least: float = 0.0
) -> FittedModel:
    """The fit with one more effect, all numbers free; `again`: a second start too, if the first misses; `least`: the
    share of the misfit below which it is of no use, so that it need not be finished.

    A descent that overshot may leave the effect off, from where nothing leads back: then it begins where that is faint,
    unless it only harms there.
    """
    model = problem.model((*model_fit.effects, candidate.effect))
    if _is_lost(problem, model_fit, model, candidate):
        candidate, fit = _from_elsewhere(problem, model_fit, model, candidate)
        return with_selection(problem, model, fit, (*model_fit.known, candidate))
    fit = _fitted(problem, model_fit, model, (candidate,), least)
    if again and not fit.chi2 < decide.CLOSED:
        moved, other = _from_elsewhere(problem, model_fit, model, candidate)
        if not fit.ok or other.squares.sum() < fit.squares.sum():
            fit, candidate = other, moved
    refitted = with_selection(problem, model, fit, (*model_fit.known, candidate))
    if candidate.effect.has_memory or not is_switched_off(refitted):
        return refitted
    faint = Candidate(candidate.effect, at_strength(candidate.effect, _FAINT))
    if not _helps(problem, model_fit, model, faint, _WEAKER):
        return refitted
    other = with_selection(problem, model, _fitted(problem, model_fit, model, (faint,)), (*model_fit.known, faint))
    return min(refitted, other, key=lambda each: float(each.fit.squares.sum()))


def refit_together(problem: EstimationProblem, model_fit: FittedModel, candidates: Sequence[Candidate]) -> FittedModel:
    """The fit with several more effects at once, all numbers free."""
    effects = (*model_fit.effects, *(candidate.effect for candidate in candidates))
    model = problem.model(effects)
    fit = _fitted(problem, model_fit, model, candidates)
    return with_selection(problem, model, fit, (*model_fit.known, *candidates))


def refit_from_declared(problem: EstimationProblem, model_fit: FittedModel) -> FittedModel:
    """The fit made again from the numbers that the rig declares, if that is better: else the fit itself.

    Numbers absorb an effect while the model lacks it, and may not find back by themselves.
    """
    own = len(problem.free)
    x = np.concatenate((np.zeros(own), model_fit.fit.x[own:]))
    p = numbers_at(model_fit.model, model_fit.fit.free, x, model_fit.fit.p)
    guess = model_fit.model.starts(problem.train, p)
    fit = fit_numbers(model_fit.model, problem.train, model_fit.fit.free, x, p, guess, problem.kappas)
    if not fit.squares.sum() < model_fit.fit.squares.sum():
        return model_fit
    return with_selection(problem, model_fit.model, fit, model_fit.known)


def refit_without_last_effect(problem: EstimationProblem, before: FittedModel, after: FittedModel) -> FittedModel:
    """The fit `before`, made again from the numbers of `after`, which has one more effect, if that is better.

    An effect may seem to explain what a fit that stopped half way left: if the numbers found with it do better without
    it than the fit before, that fit was no optimum, and says nothing of what is missing.
    """
    own = len(before.fit.free)
    p = numbers_at(before.model, before.fit.free, after.fit.x[:own], before.fit.p)
    x0, squares = predicted_states(before.model, problem.train, p)
    if not squares.sum() < before.fit.squares.sum():
        return before
    fit = fit_numbers(before.model, problem.train, before.fit.free, after.fit.x[:own], p, x0, problem.kappas)
    if not fit.squares.sum() < before.fit.squares.sum():
        return before
    return with_selection(problem, before.model, fit, before.known)


def is_switched_off(model_fit: FittedModel) -> bool:
    """Whether the effect that was added last was fitted to nothing: then only its free states explain anything."""
    effect, values = (
        model_fit.known[-1].effect,
        dict(zip(model_fit.model.parameters, model_fit.fit.p, strict=True)),
    )
    strong = [number for number in effect.fitted if number.off is not None]
    return all(
        abs(values[effect.key(n.name)] - (n.off or 0.0)) <= _GONE * abs(n.typical - (n.off or 0.0)) for n in strong
    )


def refit_all_windows(problem: EstimationProblem, model_fit: FittedModel) -> FittedModel:
    """The fit continued on all windows of a problem."""
    guess = model_fit.model.starts(problem.train, model_fit.fit.p)
    fit = fit_numbers(
        model_fit.model, problem.train, model_fit.fit.free, model_fit.fit.x, model_fit.fit.p, guess, problem.kappas
    )
    return with_selection(problem, model_fit.model, fit, model_fit.known)


def with_selection(problem: EstimationProblem, model: Model, fit: Fit, known: tuple[Candidate, ...]) -> FittedModel:
    """A fit with its errors on what it did not see: the select windows, or blocks of the train windows in turn."""
    if problem.select is None:
        return FittedModel(known, model, fit, Selection(fit.unseen, fit.samples))
    samples = problem.select.samples
    if not fit.ok:
        return FittedModel(known, model, fit, Selection(np.full(problem.select.count, np.inf), samples))
    squares = run(problem, model, problem.select, fit.p)[1]
    return FittedModel(known, model, fit, Selection(squares, samples))


def numbers_explain(problem: EstimationProblem, model_fit: FittedModel, heldout: HeldoutErrors) -> bool:
    """Whether a misfit on held-out records is one of numbers alone, which the train records tell too little of: fitted
    to both, the same model leaves no misfit in either."""
    fit, windows = model_fit.fit, problem.train.and_those_of(problem.heldout)
    guess = np.concatenate((fit.x0, heldout.x0))
    both = fit_numbers(model_fit.model, windows, fit.free, fit.x, fit.p, guess, problem.kappas, near=True)
    parts = (problem.train, both.squares[: problem.train.count]), (problem.heldout, both.squares[problem.train.count :])
    return not any(problem.misses(float(squares.sum()) / part.samples, part.samples) for part, squares in parts)


def heldout_errors(problem: EstimationProblem, model_fit: FittedModel) -> HeldoutErrors:
    """The errors of a fit on the held-out records: to be asked when all is decided."""
    x0, squares = run(problem, model_fit.model, problem.heldout, model_fit.fit.p)
    return HeldoutErrors(x0, squares, problem.heldout.samples)


def run(problem: EstimationProblem, model: Model, windows: Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Initial states [w, n] that fit the windows best, or the first rows of a free run, and the squared errors [w]."""
    return free_runs(model, windows, p) if problem.free_run else predicted_states(model, windows, p)


def _fitted(
    problem: EstimationProblem,
    model_fit: FittedModel,
    model: Model,
    candidates: Sequence[Candidate],
    least: float = 0.0,
) -> Fit:
    """The fit from the strength at which least is left once numbers and initial states follow it.

    With an effect with memory by secants; where that leaves a misfit, its tangents go on, if they predict better.
    Without, a fit that harms what it did not see was caught on the way: it is made again from where nothing follows,
    unless it explains less than the `least` share of what it did see.
    """
    had = float(model_fit.fit.squares.sum())
    most = had - least * max(had - problem.train.samples, 0.0) if least else np.inf
    follower = Follower(model_fit.model, problem.train, model_fit.fit, model, candidates)
    start, _ = follower.best(_WEAKER)

    def by_tangents(at: Start | Fit) -> FittedModel:
        start = follower.free, at.x, at.p, at.x0
        near = not problem.free_run
        fit = fit_numbers(model, problem.train, *start, problem.kappas, _REFIT_ROUNDS, near, most)
        return with_selection(problem, model, fit, ())

    if any(candidate.effect.has_memory for candidate in candidates):
        fitted = with_selection(problem, model, follower.fit(start, problem.kappas, _REFIT_ROUNDS), ())
        enough, other = decide.CLOSED * fitted.samples, fitted.fit
    else:
        fitted = by_tangents(start)
        if fitted.fit.squares.sum() > most:
            return fitted.fit
        enough, other = model_fit.squares, follower.start(steps=0)
    if fitted.squares < enough:
        return fitted.fit
    return min(fitted, by_tangents(other), key=lambda fitted: fitted.squares).fit


def _from_elsewhere(
    problem: EstimationProblem, model_fit: FittedModel, model: Model, candidate: Candidate
) -> tuple[Candidate, Fit]:
    """A fit from another start, and that start: by way of short windows for an effect with memory."""
    if candidate.effect.has_memory:
        return fit_short_windows_first(problem, model_fit.model, model_fit.fit, model, candidate.effect, _REFIT_ROUNDS)
    moved = _elsewhere(candidate)
    return moved, _fitted(problem, model_fit, model, (moved,))


def _is_lost(problem: EstimationProblem, model_fit: FittedModel, model: Model, candidate: Candidate) -> bool:
    """Whether an effect with memory harms at every strength near its start, as a loop hunts on it, or rattles: impacts
    make whole windows steep at any strength."""
    effect = candidate.effect
    return effect.rattles or (effect.has_memory and not _helps(problem, model_fit, model, candidate, _NEAR))


def _helps(
    problem: EstimationProblem, model_fit: FittedModel, model: Model, candidate: Candidate, shares: Sequence[float]
) -> bool:
    """Whether an effect leaves less than nothing of it does at one of the `shares` of its start, largest first."""
    return Follower(model_fit.model, problem.train, model_fit.fit, model, (candidate,)).best(shares)[1]


def _elsewhere(candidate: Candidate) -> Candidate:
    """Another start: what shapes the effect far from where it was, or at typical strength where nothing does."""
    start = dict(candidate.start)
    for number in candidate.effect.fitted:
        if number.off is None:
            moved = start[number.name] * _ELSEWHERE
            start[number.name] = float(np.clip(moved, number.low, number.high))
        else:
            start[number.name] = 0.5 * (start[number.name] + number.typical)
    return Candidate(candidate.effect, start)
