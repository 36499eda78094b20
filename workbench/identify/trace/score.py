"""Which effects could explain a residual? A score test: each is tried at a small strength, without any refit.

g is the change of the predictions by an effect, less what initial states and numbers could do as well; the errors
would fall by <g, e>^2/<g, g> if the effect had the strength that fits best (Rao's score test for one direction). The
cosines between the g of two effects say what a campaign can tell apart, before any refit.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...plant.effects import Effect
from ...rigs.rig import Rig
from ..fit.free_parameters import Candidate, at_strength, extend_parameters, model_with, strengths
from ..fit.model import Model
from ..fit.normal_equations import STATE_PULL, slopes_of, stable
from ..fit.solver import Fit
from ..fit.windows import Windows

STRENGTHS = (0.03, 0.3, 2.0)  # of typical: an effect that is not linear in its strength shows at one of them
_STEP, _FURTHER = 0.3, 3  # to the next lower strength where the least is too strong, and how many times
_TELLING, _LONGEST = 12, 30.0  # windows: 6 s; of longer ones as many as last 30 s
_DEAD = 1e-3  # of what an effect changes as it was tried: it is as good as off
_SMALLEST, _LARGEST = 0.2, 5.0  # how far beyond a tried strength the fit may be started


@dataclass(frozen=True)
class _ScoredEffect:
    """An effect at a strength: all its strengths or `only` one, with `shape` for the numbers that only shape it."""

    effect: Effect
    strength: float
    only: str | None = None
    shape: tuple[tuple[str, float], ...] = ()

    def numbers(self, factor: float = 1.0) -> dict[str, float]:
        return at_strength(self.effect, self.strength * factor, self.only) | dict(self.shape)


@dataclass(frozen=True, eq=False)
class EffectDirection:
    """An effect as it was tried: its g as a unit vector [samples], <g, g>, and by what factor of the tried strength it
    fits best alone."""

    tried: _ScoredEffect
    shape: np.ndarray
    square: float
    factor: float

    @property
    def effect(self) -> Effect:
        """What was tried."""
        return self.tried.effect

    @property
    def two_sided(self) -> bool:
        """Whether the effect may be the other way round."""
        return any(n.off is not None and n.low < n.off < n.high for n in self.effect.numbers)

    @property
    def amplitude(self) -> float:
        """How far along the unit vector the effect fits best alone."""
        return self.factor * float(np.sqrt(self.square))

    @property
    def gain(self) -> float:
        """The fall of the squared errors; 0 where the effect would have to be what it cannot."""
        return self.factor * self.factor * self.square if self.factor > 0 or self.two_sided else 0.0

    def candidate(self, amplitude: float | None = None) -> Candidate:
        """The effect with the numbers to start a refit from: where it has an amplitude, or fits best alone."""
        factor = self.factor if amplitude is None else amplitude / float(np.sqrt(self.square))
        near = float(np.sign(factor) * np.clip(abs(factor), _SMALLEST, _LARGEST))
        return Candidate(self.effect, self.tried.numbers(near))


@dataclass(frozen=True, eq=False)
class Score:
    """An effect's gain (fall of the squared errors), the numbers to start a refit from, and its g [samples], all where
    it gains most; and every trial."""

    candidate: Candidate
    gain: float
    shape: np.ndarray
    trials: tuple[EffectDirection, ...]


class NuisanceProjection:
    """Takes out of a change of the errors what initial states and fitted numbers could do as well.

    `errors` are those of the fit, [w, rows, signals] a group.
    """

    def __init__(self, model: Model, windows: Windows, fit: Fit) -> None:
        n, self.errors = model.plant.n, model.errors(windows, fit.x0, fit.p)
        slopes = [stable(whole) for whole in slopes_of(model, windows, fit.x0, fit.p, fit.free, fit.x)]
        self._states = [whole[..., :n] for whole in slopes]
        self._inverse = [
            np.linalg.inv(np.swapaxes(x, 1, 2) @ x + np.eye(n) / STATE_PULL**2) @ np.swapaxes(x, 1, 2)
            for x in self._states
        ]
        numbers = self.without_states([whole[..., n:] for whole in slopes])
        self._numbers = np.concatenate([part.reshape(-1, part.shape[-1]) for part in numbers])
        self._names = [free.name for free in fit.free]
        self._pinned = fit.at_bounds if windows.from_rest else ()
        self._basis = _basis(self._numbers)

    def without(self, number: str) -> "NuisanceProjection":
        """This projection where a number, if one is named, stays: what shifts it is no nuisance then. In free runs
        from rest nor are others that are at an end of their range: any may be the number that is another one."""
        others, stay = copy(self), {number, *self._pinned}
        others._basis = _basis(self._numbers[:, [name not in stay for name in self._names]])
        return others

    def __call__(self, change: Sequence[np.ndarray]) -> np.ndarray:
        """What is left of a change [w, rows, signals] of every group, as one vector."""
        parts = self.without_states([part.reshape(len(part), -1, 1) for part in change])
        left = np.concatenate([part.ravel() for part in parts])
        return left - self._basis @ (self._basis.T @ left)

    def numbers(self) -> list[np.ndarray]:
        """What each fitted number does to the errors [samples] beyond what initial states could do."""
        return list(self._numbers.T)

    def without_states(self, parts: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Changes [w, rows * signals, k] of every group, less what initial states could do as well."""
        return [p - x @ (inverse @ p) for p, x, inverse in zip(parts, self._states, self._inverse, strict=True)]


def _basis(numbers: np.ndarray) -> np.ndarray:
    """An orthonormal basis [samples, k] of what numbers can do [samples, k]."""
    size = np.linalg.norm(numbers, axis=0)
    return np.linalg.svd(numbers / np.maximum(size, 1e-300), full_matrices=False)[0]


def score(
    rig: Rig, known: Sequence[Effect], effect: Effect, base: Model, windows: Windows, fit: Fit, rest: NuisanceProjection
) -> Score:
    """The score of one effect beside those that are `known` already, about a fit of the model `base`, a coarse one."""
    brief = not windows.from_rest or bool(known)  # what a further pass compiles no other trace will find compiled
    model = model_with(rig, (*known, effect), windows.names, brief, base.sessions, coarse=True)
    plain = rest.errors
    rest = rest.without(effect.shifts) if effect.shifts else rest
    left = rest(plain)

    def trials_of(tried: Sequence[_ScoredEffect]) -> list[EffectDirection | None]:
        numbers = [each.numbers() for each in tried]
        if windows.from_rest:
            changes = _changes_from_rest(model, base, windows, fit, effect, numbers)
        else:
            changes = [effect_change(model, base, windows, fit, effect, each, plain) for each in numbers]
        return [
            None if change is None else _trial(each, rest(change), left)
            for each, change in zip(tried, changes, strict=True)
        ]

    usual = trials_of(_tried(effect))
    weaker = _weaker(effect, lambda tried: trials_of([tried])[0], usual[0], float(left @ left))
    trials = (*(done for done in usual if done is not None), *weaker)
    best = max(trials, key=lambda trial: trial.gain, default=None)
    if best is None or best.gain == 0:
        return Score(Candidate(effect, at_strength(effect, 1.0)), 0.0, np.zeros_like(left), trials)
    return Score(_begun(best, trials_of), best.gain, best.shape, trials)


def _begun(best: EffectDirection, trials_of: Callable[..., list[EffectDirection | None]]) -> Candidate:
    """The numbers to start a refit from: where the effect fits best alone, or, where it is as good as off there since
    it acts beyond a threshold, as it was tried."""
    nearer = replace(best.tried, strength=best.tried.strength * float(np.clip(abs(best.factor), _SMALLEST, 1.0)))
    (there,) = trials_of([nearer]) if nearer.strength < best.tried.strength else [best]
    dead = there is not None and there.square < _DEAD * best.square
    return best.candidate(float(np.sqrt(best.square)) if dead else None)


def worst_windows(windows: Windows, fit: Fit) -> tuple[Windows, Fit]:
    """The windows where a fit is most wrong, and the fit in them: no need to try an effect on all, but for free runs
    from rest, each of which is of its own kind."""
    if windows.from_rest:
        return windows, fit
    lasts = float(np.median([np.ptp(group.t[0]) for group in windows.groups]))
    telling = min(_TELLING, max(1, round(_LONGEST / lasts)))
    keep = np.sort(np.argsort(-fit.squares, kind="stable")[:telling])
    return windows.some(keep.tolist()), replace(fit, x0=fit.x0[keep], squares=fit.squares[keep])


def cosines(scores: Sequence[Score]) -> np.ndarray:
    """Absolute cosines between the effects' shapes [k, k]: at 1 this campaign cannot tell two of them apart."""
    shapes = np.array([item.shape for item in scores])
    return np.abs(shapes @ shapes.T)


def initial_states_with_effect(
    model: Model, base: Model, windows: Windows, x0: np.ndarray, p: np.ndarray
) -> np.ndarray:
    """Initial states [w, n] of a plant with further effects: those of the base, its own as the window before ends."""
    if model.plant.n == base.plant.n:
        return x0
    states = model.starts(windows, p)
    for column, state in enumerate(base.plant.states):
        states[:, model.plant.state(state.name)] = x0[:, column]
    return states


def effect_change(
    model: Model,
    base: Model,
    windows: Windows,
    fit: Fit,
    effect: Effect,
    numbers: Mapping[str, float],
    plain: Sequence[np.ndarray],
) -> list[np.ndarray] | None:
    """What the effect changes in the errors of every group; None where it cannot be simulated."""
    p = extend_parameters(base.plant, fit.p, model.plant)
    p = model.plant.parameter_values(p, **{effect.key(name): value for name, value in numbers.items()})
    x0 = initial_states_with_effect(model, base, windows, fit.x0, p)
    changed = [a - b for a, b in zip(model.errors(windows, x0, p), plain, strict=True)]
    return changed if all(np.isfinite(part).all() for part in changed) else None


def _changes_from_rest(
    model: Model, base: Model, windows: Windows, fit: Fit, effect: Effect, numbers: Sequence[Mapping[str, float]]
) -> list[list[np.ndarray] | None]:
    """What the effect changes in the errors of free runs from rest with each of several `numbers`, all at once."""
    p = extend_parameters(base.plant, fit.p, model.plant)
    none, *moved = (
        model.plant.parameter_values(p, **{effect.key(name): value for name, value in each.items()})
        for each in (at_strength(effect, 0.0), *numbers)
    )
    changes = model.changes_from_rest(windows, none, np.array(moved))
    shapes = [group.weight.shape for group in windows.groups]
    return [
        [change[..., k].reshape(shape) for change, shape in zip(changes, shapes, strict=True)]
        for k in range(len(numbers))
    ]


def _tried(effect: Effect) -> list[_ScoredEffect]:
    """Every strength of the whole effect, then each of its strengths alone, and every shape at a small strength."""
    names = strengths(effect)
    trials = [_ScoredEffect(effect, strength) for strength in STRENGTHS]
    if len(names) > 1:
        trials += [_ScoredEffect(effect, STRENGTHS[1], only) for only in names]
    shapes = [(number.name, value) for number in effect.numbers for value in number.tried]
    return trials + [_ScoredEffect(effect, STRENGTHS[0], shape=(shape,)) for shape in shapes]


def _weaker(
    effect: Effect, trial: Callable[[_ScoredEffect], EffectDirection | None], least: EffectDirection | None, left: float
) -> Iterator[EffectDirection]:
    """Trials below the `least` strength, as long as the effect changes more than all that is `left` to explain."""
    for power in range(1, _FURTHER + 1):
        if least is None or least.square <= left:
            return
        least = trial(_ScoredEffect(effect, STRENGTHS[0] * _STEP**power))
        if least is not None:
            yield least


def packed_trial(trial: EffectDirection) -> dict[str, Any]:
    """A trial as plain data and arrays, without its effect."""
    tried = {name: getattr(trial.tried, name) for name in ("strength", "only", "shape")}
    return {"tried": tried, "shape": trial.shape, "square": trial.square, "factor": trial.factor}


def unpacked_trial(stored: Mapping[str, Any], effect: Effect) -> EffectDirection:
    """The trial again."""
    return EffectDirection(**{**stored, "tried": _ScoredEffect(effect, **stored["tried"])})


def _trial(tried: _ScoredEffect, shape: np.ndarray, left: np.ndarray) -> EffectDirection:
    square = float(shape @ shape)
    factor = -float(shape @ left) / square if square > 0 else 0.0
    return EffectDirection(tried, shape / np.sqrt(square) if square > 0 else shape, square, factor)
