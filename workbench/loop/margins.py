"""The sampled loop, linearised: closed loop, sensitivity and margins, or the plain word that it is unstable."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..base.gain_phase import gain_db
from ..control.protocol import Controller, linear_view
from ..linear import Equilibrium
from ..linear.crossings import crossings
from ..linear.interconnect import feedback
from ..linear.sampling import sampled_plant
from ..linear.state_space import StateSpace, sampled_response
from ..plant import Plant

_LOWEST = 1e-4  # Hz: crossings of the slowest loop that any controller allows
_POINTS = 600  # over all frequencies; more where something happens
_MODE = np.sinh(np.linspace(-3.5, 3.5, 21))  # half widths of a resonance, from its middle, at which it is looked at
STABLE = 1 - 1e-9  # |z| of every pole of a stable loop is below this
_ROUNDS, _INSIDE = 3, 7  # each splits the intervals of crossings and peaks by so many points


@dataclass(frozen=True)
class LinearLoop:
    """A linearised sampled loop over f [k] in Hz up to the Nyquist frequency, closest where it crosses or resonates.

    `closed` is reference -> controlled signal, `sensitivity` 1/(1 + L) at the command. An unstable loop has no margins:
    its gain and phase margin, Ms, closed loop and sensitivity are None.
    """

    stable: bool
    f: np.ndarray
    open: np.ndarray
    closed: np.ndarray | None
    sensitivity: np.ndarray | None
    gain_margin_db: float | None
    phase_margin_deg: float | None
    ms: float | None


def closed_poles(
    plant: Plant, about: Equilibrium, controller: Controller, period: float, p: np.ndarray | None = None
) -> np.ndarray:
    """Poles z [k] of the loop that `linear_loop` closes, without the time that its margins take."""
    law = linear_view(controller, signals_at(plant, about, p))
    return _closed(sampled_plant(plant, about, period, controller.measures, p), law).poles()


def signals_at(plant: Plant, about: Equilibrium, p: np.ndarray | None = None) -> dict[str, float]:
    """The plant's outputs and the command at an operating point, SI, by name: what a controller's linear view needs."""
    outputs = np.array(plant.h(about.x, about.u, plant.p if p is None else p)).ravel()
    return {**dict(zip(plant.outputs, outputs.tolist(), strict=True)), "command": float(about.u[0])}


def linear_loop(
    plant: Plant, about: Equilibrium, controller: Controller, period: float, p: np.ndarray | None = None
) -> LinearLoop:
    """Close a controller's linear view on the plant linearised at a point, held and sampled every `period` [s].

    A delay of the plant's command counts, exactly.
    """
    model = sampled_plant(plant, about, period, controller.measures, p)
    law = linear_view(controller, signals_at(plant, about, p))
    poles = _closed(model, law).poles()

    def responses(f: np.ndarray) -> np.ndarray:
        """Open loop, and reference -> controlled signal without the loop, [2, k]."""
        z = np.exp(2j * np.pi * f * period)
        measured, gains = sampled_response(model, z)[:, 0], sampled_response(law, z)[0]
        return np.stack((-np.sum(gains[1:] * measured, axis=0), gains[0] * measured[0]))

    f, (loop, forward) = _refined(responses, _grid(np.append(poles, model.poles()), period))
    if not np.abs(poles).max() < STABLE:
        return LinearLoop(False, f, loop, None, None, None, None, None)
    sensitivity = 1 / (1 + loop)
    gain, phase = _gain_margin(loop), _phase_margin(loop)
    return LinearLoop(True, f, loop, forward * sensitivity, sensitivity, gain, phase, float(np.abs(sensitivity).max()))


def _closed(plant: StateSpace, law: StateSpace) -> StateSpace:
    """Plant and controller in closed loop; what is measured has not heard of this sample's command yet."""
    return feedback(replace(plant, D=np.zeros_like(plant.D)), law)


def _grid(poles: np.ndarray, period: float) -> np.ndarray:
    """Frequencies [Hz] up to Nyquist's, even on a logarithmic scale, and close where these poles resonate."""
    nyquist = 0.5 / period
    turning = poles[(np.imag(poles) > 0) & (np.abs(poles) > 0)]
    middle, width = (part / (2 * np.pi * period) for part in (np.angle(turning), np.abs(np.log(np.abs(turning)))))
    near = (middle[:, None] + width[:, None] * _MODE).ravel()
    near = near[(near > _LOWEST) & (near < nyquist)]
    return np.unique(np.concatenate((np.geomspace(_LOWEST, nyquist, _POINTS), near)))


def _refined(responses: Callable[[np.ndarray], np.ndarray], f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The grid with more points where the loop crosses unit gain or the real axis, and about peaks; responses there."""
    values = responses(f)
    part = np.arange(1, _INSIDE + 1) / (_INSIDE + 1)
    for _ in range(_ROUNDS):
        loop = values[0]
        sizes = (np.abs(loop), np.abs(1 + loop))
        unit_gain, real_axis = crossings(sizes[0], 1.0)[0], crossings(np.imag(loop))[0]
        split = np.unique(np.concatenate((unit_gain, real_axis, *(_beside_extremes(size) for size in sizes))))
        more = (f[split, None] * (f[split + 1] / f[split])[:, None] ** part).ravel()
        f, values = np.append(f, more), np.hstack((values, responses(more)))
        order = np.argsort(f)
        f, values = f[order], values[:, order]
    return f, values


def _beside_extremes(value: np.ndarray) -> np.ndarray:
    """Intervals [n] on both sides of each least or largest inner value of [k]."""
    turns = crossings(np.diff(value))[0]
    return np.concatenate((turns, turns + 1))


def _gain_margin(loop: np.ndarray) -> float | None:
    """Least gain margin [dB] in either direction; the last value is at the Nyquist frequency, on the real axis."""
    real = np.real(loop)
    i, part = crossings(np.imag(loop))
    real = np.append(real[i] + part * (real[i + 1] - real[i]), real[-1])
    return min(np.abs(gain_db(real[real < 0])).tolist(), default=None)


def _phase_margin(loop: np.ndarray) -> float | None:
    """Least phase margin [deg] in either direction."""
    i, part = crossings(np.log(np.abs(loop)))
    at = loop[i] + part * (loop[i + 1] - loop[i])
    return min(np.abs(np.degrees(np.angle(-at))).tolist(), default=None)
