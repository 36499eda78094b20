"""What one session says of a rig: how its errors would answer to each number, each effect and each sensor.

To first order the squared errors over sigma of a session are e2 + 2 b'q + q'A q for a move q of the rig's numbers, of
effects that it lacks and of its sensors, the initial states following. A, b and e2 are all that sessions have to keep,
so that what holds over a year is found without a recording being simulated again (Rao's score test, over sessions).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...plant.effects import Effect, applies
from ...records import Record
from ...rigs.rig import Rig
from ..fit.determined import FreeParameter
from ..fit.free_parameters import at_strength, model_with
from ..fit.model import Model
from ..fit.normal_equations import numbers_at
from ..fit.solver import Fit, fit_numbers
from ..fit.unexplained import unexplained_signals
from ..fit.windows import Windows
from ..found.untold import without_untold
from ..trace.problem import EstimationProblem
from ..trace.refit import fit_rig
from ..trace.score import NuisanceProjection, effect_change

STRENGTH = 0.1  # of an effect's typical strength, at which its slope is taken
# How a healthy rig moves from session to session, one standard deviation.
# Of the number: some 5 K of the oil (viscosity 3 % a kelvin: Merritt, Hydraulic Control Systems, ch. 2), a pump.
HEALTHY = {"b": 0.15, "beta": 0.03, "Cl": 0.1, "Ps": 0.02}
_SMALL = 0.1  # of its range: no number is held to less than that much of it
LITTLE = 0.005  # of any other number, or of an effect's typical strength
OF_SCALE, OF_ZERO = 0.002, 0.01  # a transducer's, of its reading, and of a twentieth of how far it moves
HELD = 3.0 * 2**0.5  # such deviations, to which the rig's numbers are held about the first session, which wanders too
_CALIBRATED = 10.0  # such deviations, within which a transducer's scale and zero are: 2 %, 0.5 % of how far it moves
ROUNDS = 8  # of Gauss-Newton at most: a window that a supply 1 % higher leads elsewhere takes five
COMMAND = "command"  # the drive's input, whose gain and zero may change as a sensor's do
_INPUT_STEP = 0.005  # of the command, at which its slope is taken
Columns = list[np.ndarray]
EffectModels = Sequence[tuple[Effect, Model]]


@dataclass(frozen=True)
class Axis:
    """A direction in which a rig may change: a number of it, an effect, or a sensor's scale or zero.

    A move of 1 is `scale` of the SI `unit`. `value`: of the rig as it was first; 0 for an effect or a sensor.
    `healthy`: the move from session to session of a rig that nothing ails. `one_way`: it cannot be less than nothing.
    `number`: it is the rig's.
    """

    name: str
    unit: str
    scale: float = 1.0
    value: float = 0.0
    healthy: float = LITTLE
    one_way: bool = False
    number: bool = False

    @property
    def reach(self) -> float:
        """How far the mean of a rig's sessions may be from the first one, in moves, one standard deviation: where some
        axes together change nothing that is recorded, this is what parts them."""
        return _CALIBRATED * self.healthy if self.name.endswith((".scale", ".zero")) else 1.0

    def at(self, move: float) -> float:
        """The number in SI after a move."""
        return self.value + self.scale * move


@dataclass(frozen=True, eq=False)
class SessionEvidence:
    """Evidence of one session: `axes` [n], the rig's numbers first; `at` [n], where the errors were taken to first
    order; matrix A [n, n] and gradient b [n] there, of squared errors over sigma; samples; chi2 there."""

    axes: tuple[Axis, ...]
    at: np.ndarray
    matrix: np.ndarray
    gradient: np.ndarray
    samples: int
    chi2: float
    residuals: Mapping[str, float]

    def json(self) -> dict[str, Any]:
        """The evidence as plain data."""
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in asdict(self).items()
        }


def from_json(stored: Mapping[str, Any]) -> SessionEvidence:
    """The evidence again."""
    axes = tuple(Axis(**axis) for axis in stored["axes"])
    arrays = {name: np.array(stored[name], dtype=float) for name in ("at", "matrix", "gradient")}
    return SessionEvidence(**{**stored, **arrays, "axes": axes})


def watched_effects(rig: Rig, library: Sequence[Effect]) -> list[Effect]:
    """One formula, the library's first, of each effect that the rig has room for and lacks."""
    known = {use.name for use in rig.effects}
    able = [effect for effect in library if applies(effect, rig) and effect.name not in known]
    return list({effect.name: effect for effect in reversed(able)}.values())[::-1]


def rig_as_found(rig: Rig, problem: EstimationProblem) -> Rig:
    """The rig with its uncertain numbers as a first session has them, held to what healthy rigs do, or to what that
    session tells of them, and to one side of 0 where they are declared so. Raises InputError where no fit is near."""
    fit, untold = without_untold(problem, fit_rig(problem))
    numbers = dict(rig.numbers)
    for k, (free, x) in enumerate(zip(fit.free, fit.x, strict=True)):
        if free.name in numbers and free.name not in untold:
            value, (low, high) = free.value(float(x)), fit.interval(k)
            healthy = HEALTHY.get(free.name, LITTLE) * max(abs(value), _SMALL * (free.high - free.low))
            reach = max(HELD * healthy, high - low)
            least = free.low if value - reach <= 0 <= free.low else value - reach
            ends = {"low": least, "high": value + reach}
            numbers[free.name] = replace(numbers[free.name], value=value, interval=None, **ends)
    return replace(rig, numbers=numbers)


def near_fit(problem: EstimationProblem, rounds: int = ROUNDS, at: Mapping[str, float] | None = None) -> Fit:
    """The fit of a rig whose numbers are near: a few rounds from where they are, or from values [SI] by name; past no
    window that is far off.

    Raises InputError where the rig, fitted, does not follow the records.
    """
    model, windows, free = problem.model(), problem.train, problem.free
    x = np.array([each.normalised(at[each.name]) if at and each.name in at else 0.0 for each in free])
    guess = model.starts(windows, numbers_at(model, free, x, model.p))
    fit = fit_numbers(model, windows, free, x, model.p, guess, problem.kappas, rounds, near=True)
    lost = unexplained_signals(model, windows, fit.x0, fit.p) if fit.ok else ["any signal"]
    if lost:
        raise InputError(
            f"the rig of the first session, fitted, is no nearer to {', '.join(lost)} than a constant would be; check "
            "units and signs, and whether the same rig was recorded"
        )
    return fit


def effect_models(problem: EstimationProblem, library: Sequence[Effect]) -> EffectModels:
    """The rig with each effect that it lacks: the same for every session in which the same signals are compared."""
    names, from_rest = problem.train.names, problem.train.from_rest
    return [
        (effect, model_with(problem.rig, (effect,), names, True, problem.sessions, from_rest))
        for effect in watched_effects(problem.rig, library)
    ]


def session_evidence(problem: EstimationProblem, models: EffectModels) -> SessionEvidence:
    """A session's errors to first order about its fit, of a rig whose numbers are held to what healthy ones do.

    Numbers that were free would follow what an effect does; numbers that stayed would leave so much of the oil's
    temperature that what a first order neglects would be more than the noise. Raises InputError where no fit is near.
    """
    model, windows, free = problem.model(), problem.train, problem.free
    fit = near_fit(problem)
    rest = NuisanceProjection(model, windows, fit)
    axes, columns = [_number_axis(each, problem.rig) for each in free], rest.numbers()
    for axis, change in [
        *_effects(problem, models, model, fit, rest.errors),
        *sensor_changes(problem, model, fit, rest.errors),
        *command_changes(problem, model, fit, rest.errors),
    ]:
        axes.append(axis)
        columns.append(_flat(rest.without_states([part.reshape(len(part), -1, 1) for part in change])))
    slope = np.column_stack(columns)
    errors = _flat(rest.without_states([part.reshape(len(part), -1, 1) for part in rest.errors]))
    at = np.zeros(len(axes))
    at[: len(free)] = fit.x
    return SessionEvidence(
        tuple(axes),
        at,
        slope.T @ slope / problem.kappa,
        slope.T @ errors / problem.kappa,
        windows.samples,
        fit.chi2,
        _by_signal(windows.names, rest.errors),
    )


def _number_axis(free: FreeParameter, rig: Rig) -> Axis:
    unit = rig.numbers[free.name].si if free.name in rig.numbers else "1"
    scale = free.width if free.scale is None else free.scale
    healthy = min(HEALTHY.get(free.name, LITTLE) * abs(free.start) / scale, 1 / HELD)
    return Axis(free.name, unit, scale, free.start, max(healthy, LITTLE), number=True)


def _effects(
    problem: EstimationProblem, models: EffectModels, model: Model, fit: Fit, errors: Sequence[np.ndarray]
) -> list[tuple[Axis, Columns]]:
    """Each effect that the rig lacks, with the slopes of the errors to its strength."""
    found = []
    for effect, strong in models:
        change = effect_change(strong, model, problem.train, fit, effect, at_strength(effect, STRENGTH), errors)
        if change is not None:
            one_way = not any(n.off is not None and n.low < n.off < n.high for n in effect.numbers)
            found.append((Axis(effect.name, "typical", one_way=one_way), [part / STRENGTH for part in change]))
    return found


def sensor_changes(
    problem: EstimationProblem, _model: Model, _fit: Fit, errors: Sequence[np.ndarray]
) -> list[tuple[Axis, Columns]]:
    """The scale and the zero of each sensor that is compared, with what they change in the errors.

    The scale multiplies what the model predicts: a reading has noise, which would explain itself.
    """
    found, windows, rig = [], problem.train, problem.rig
    for k, name in enumerate(windows.names):
        only = np.arange(len(windows.names)) == k
        true = [
            np.where((group.weight > 0) & only, group.measured * group.weight + error, 0.0)
            for group, error in zip(windows.groups, errors, strict=True)
        ]
        found.append((Axis(f"{name}.scale", "1", healthy=OF_SCALE), true))
        step = _typical_step(windows, k)
        zero = [group.weight * only * step for group in windows.groups]
        found.append((Axis(f"{name}.zero", rig.signal(name).si, step, healthy=OF_ZERO), zero))
    return found


def command_changes(
    problem: EstimationProblem, model: Model, fit: Fit, errors: Sequence[np.ndarray]
) -> list[tuple[Axis, Columns]]:
    """The gain and the zero of the drive's input, with what they change in the errors."""
    windows, found = problem.train, []
    for axis, scale, zero in (("scale", _INPUT_STEP, 0.0), ("zero", 0.0, _INPUT_STEP)):
        changed = model.errors(with_signal(windows, COMMAND, scale, zero), fit.x0, fit.p)
        change = [(a - b) / _INPUT_STEP for a, b in zip(changed, errors, strict=True)]
        if all(np.isfinite(part).all() for part in change):
            found.append((Axis(f"{COMMAND}.{axis}", "1", healthy=OF_SCALE if scale else 0.05 * OF_ZERO), change))
    return found


def with_signal(windows: Windows, name: str, scale: float, zero: float) -> Windows:
    """The windows as a signal says that is `scale` of itself more, and `zero` [SI] more: a plant that gets more of a
    command, or a sensor that shows more, whose readings are what they would be without."""
    if name == COMMAND:
        return replace(windows, records=_moved(windows, lambda v: np.clip((1 + scale) * v + zero, -1.0, 1.0), name))
    column = np.arange(len(windows.names)) == windows.names.index(name)
    true = [np.where(column, (group.measured - zero) / (1 + scale), group.measured) for group in windows.groups]
    groups = tuple(replace(group, measured=part) for group, part in zip(windows.groups, true, strict=True))
    return replace(windows, groups=groups, records=_moved(windows, lambda v: (v - zero) / (1 + scale), name))


def _moved(windows: Windows, to: Callable[[np.ndarray], np.ndarray], name: str) -> tuple[Record, ...]:
    return tuple(
        replace(each, signals={**each.signals, name: to(each.signals[name])}) if name in each.signals else each
        for each in windows.records
    )


def _typical_step(windows: Windows, k: int) -> float:
    """A twentieth of how far a signal moves, SI."""
    return 0.05 * max(float(np.ptp(group.measured[..., k])) for group in windows.groups) or 1.0


def _flat(parts: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate([part.ravel() for part in parts])


def _by_signal(names: Sequence[str], errors: Sequence[np.ndarray]) -> dict[str, float]:
    """RMS of the errors over sigma of each compared signal."""
    return {
        name: float(np.sqrt(np.mean(np.concatenate([part[..., k].ravel() ** 2 for part in errors]))))
        for k, name in enumerate(names)
    }
