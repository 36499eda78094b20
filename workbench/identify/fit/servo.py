"""A closed loop as a servo of few numbers: how much structure its records bear, before a plant is asked of them.

Of first order, with the speed gain g, the delay d, the zero z and the compliance c under a measured force F:
dx/dt = g (r(t - d) + z - c F - x). Of second order: x'' = w^2 (r(t - d) + z - c F - x) - 2 zeta w x'. Zero, compliance
and the states in which windows begin are linear, and eliminated (variable projection: Golub and Pereyra, SIAM J. Numer.
Anal. 10(2), 1973).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares

from ...rigs.inner_loop import InnerLoop
from .intervals import clustered, widest
from .windows import WindowGroup, Windows

PUSHES = "disturbance"  # the input by which a measured load acts
_GAINS, _DELAYS = (5.0, 20.0, 80.0), (1e-3, 1e-2)  # 1/s, s: to start from
_ZETA, _LONGEST, _SLOWEST, _FASTEST = 1.0, 0.2, 1e-2, 1e5  # 1, s, 1/s
_SCALE = 1e-3  # s: of the delay beside logarithms of the others
_STEP = 1e-3  # of these scales, for slopes
_NORMAL = 1.96

Projected = tuple[np.ndarray, np.ndarray, np.ndarray]  # what is measured [n], what is linear [n, m], the window [n]
Project = Callable[[Windows, np.ndarray], Projected]


@dataclass(frozen=True)
class Servo:
    """A servo by its numbers with their 95 % ends, {"delay [s]": [value, low, high]}; RMS error of the windows that it
    was fitted to and of others, in the SI unit of what is controlled."""

    numbers: dict[str, list[float]]
    train: float
    heldout: float


def fit_servos(loop: InnerLoop, unit: str, train: Windows, heldout: Windows) -> list[Servo]:
    """What follows that which a loop controls, of SI `unit`: of first order, the same with a compliance where a force
    is an input, and the better of both with an order more."""
    forces = [False, True] if any(PUSHES in record.signals for record in train.records) else [False]
    gain, delay = min(
        ((np.log(gain), delay) for gain in _GAINS for delay in _DELAYS),
        key=lambda q: float(np.sum(_error(_projected(loop, False, train, np.array(q))) ** 2)),
    )
    first = [_fitted(partial(_projected, loop, pushed), unit, train, heldout, [gain, delay]) for pushed in forces]
    pushed = forces[int(np.argmin([servo.heldout for servo in first]))]
    gain, delay = np.log(first[0].numbers["speed gain [1/s]"][0]), first[0].numbers["delay [s]"][0]
    start = [gain + np.log(2 * _ZETA), np.log(_ZETA), max(0.0, delay - np.exp(-gain) / 4)]
    return [*first, _fitted(partial(_projected, loop, pushed), unit, train, heldout, start)]


def _fitted(project: Project, unit: str, train: Windows, heldout: Windows, start: list[float]) -> Servo:
    """The servo of as many poles as its start has numbers beside the delay."""
    order = len(start) - 1
    low = [np.log(_SLOWEST), *([-3.0] if order == 2 else []), 0.0]
    high = [np.log(_FASTEST), *([3.0] if order == 2 else []), _LONGEST]
    scale = np.array([*(1.0 for _ in range(order)), _SCALE])
    fit = least_squares(lambda q: _error(project(train, q)), start, bounds=(low, high), x_scale=scale)
    linear = _linear(project(train, fit.x))
    halves = _halves(project, train, fit.x, linear, scale)
    names = ["speed gain [1/s]"] if order == 1 else ["frequency [rad/s]", "damping [1]"]
    names += ["delay [s]", f"zero [{unit}]", f"compliance [{unit}/N]"]
    places = zip(names, (*fit.x, *linear), halves, strict=False)  # without a compliance where nothing pushes
    ends = {name: value + half * np.array([0.0, -1.0, 1.0]) for name, value, half in places}
    numbers = {name: (np.exp(at) if k < order else at).tolist() for k, (name, at) in enumerate(ends.items())}
    errors = [_error(project(windows, fit.x), linear) for windows in (train, heldout)]
    return Servo(numbers, *(float(np.sqrt(np.mean(error**2))) for error in errors))


def _projected(loop: InnerLoop, pushed: bool, windows: Windows, q: np.ndarray) -> Projected:
    """Compared samples less what the reference alone makes of them, and what zero and force make, both without what
    the states in which windows begin can do as well."""
    parts = [_of_group(loop, pushed, windows, group, q) for group in windows.groups]
    y, columns, which = (np.concatenate(each) for each in zip(*parts, strict=True))
    return y, columns, which


def _of_group(loop: InnerLoop, pushed: bool, windows: Windows, group: WindowGroup, q: np.ndarray) -> Projected:
    from scipy.signal import lfilter  # here, as it takes a third of a second

    place = windows.names.index(loop.controls)
    compared = group.weight[..., place] > 0
    rate, held = float(np.exp(q[0])), windows.commands(group, float(q[-1]))
    poles = [1.0, rate] if len(q) == 2 else [1.0, 2 * float(np.exp(q[1])) * rate, rate**2]
    share, period = float(np.median(held.share)), float(np.median(held.interval))
    before, after, denominator = _held(poles, share * period, (1 - share) * period)
    pushes = [-windows.inputs(group).get(PUSHES, np.zeros_like(held.older))] if pushed else []
    forced = lfilter(before, denominator, loop.full_command * held.older)
    forced += lfilter(after, denominator, loop.full_command * held.newer)
    linear = lfilter(before + after, denominator, [np.ones_like(held.older), *pushes])
    impulse = np.zeros(compared.shape[1])
    impulse[0] = 1.0
    own = np.asarray(lfilter([1.0], denominator, impulse))
    free = np.column_stack([np.concatenate((np.zeros(k), own[: own.size - k])) for k in range(len(poles) - 1)])
    basis, _ = np.linalg.qr(free * compared[..., None])
    whole = np.stack([group.measured[..., place] - forced, *linear], axis=-1) * compared[..., None]
    whole = whole - basis @ (np.swapaxes(basis, 1, 2) @ whole)
    which = np.broadcast_to(group.which[:, None], compared.shape)[compared]
    return whole[compared][:, 0], whole[compared][:, 1:], which


def _held(poles: list[float], older: float, newer: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numerators of what is held for the `older` and the `newer` part [s] of a period, and the denominator; gain 1
    (Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998, ch. 4: systems with delay)."""
    from scipy.signal import ss2tf, tf2ss

    a, b, c, d = (np.asarray(part) for part in tf2ss([poles[-1]], poles))
    whole = np.block([[a, b], [np.zeros((1, len(a) + 1))]])
    (first, early), (then, late) = (np.split(expm(whole * span)[:-1], [-1], axis=1) for span in (older, newer))
    held = [ss2tf(then @ first, gamma, c, d) for gamma in (then @ early, late)]
    before, after = (np.asarray(numerator).ravel() for numerator, _ in held)
    return before, after, np.asarray(held[0][1])


def _linear(projected: Projected) -> np.ndarray:
    y, columns, _ = projected
    return np.linalg.lstsq(columns, y, rcond=None)[0]


def _error(projected: Projected, linear: np.ndarray | None = None) -> np.ndarray:
    y, columns, _ = projected
    return y - columns @ (_linear(projected) if linear is None else linear)


def _halves(project: Project, windows: Windows, q: np.ndarray, linear: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Half of the 95 % intervals of q and of what is linear [k]."""
    y, columns, which = project(windows, q)
    error = y - columns @ linear
    steps = _STEP * scale
    slopes = [
        (_error(project(windows, q + step), linear) - _error(project(windows, q - step), linear)) / (2 * step[k])
        for k, step in enumerate(np.diag(steps))
    ]
    jacobian = np.column_stack([*slopes, -columns])
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    gradients = np.zeros((windows.count, jacobian.shape[1]))
    np.add.at(gradients, which, jacobian * error[:, None])
    scatters = [np.linalg.pinv(inverse) * np.mean(error**2), clustered(gradients, windows, False)]
    return _NORMAL * np.sqrt(np.diag(widest(inverse, scatters, np.zeros_like(inverse))))
