"""The sampled loop, linearised: closed loop, sensitivity and margins, or the plain word that it is unstable."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..base.gain_phase import gain_db
from ..control.protocol import Controller, linear_view
from ..linear import Equilibrium
from ..linear.crossings import crossings
from ..linear.state_space import StateSpace, schur_form, transposed
from ..plant import Plant
from .plant_response import PlantResponse, near, plant_response

STABLE = 1 - 1e-9  # |z| of every pole of a stable loop is below this
_ROUNDS, _INSIDE = 3, 7  # each splits the intervals of crossings and peaks by so many points

Source = Literal["linear", "sine", "none"]  # of margins: the linear loop, sines on the simulated one, or there are none


@dataclass(frozen=True)
class LinearLoop:
    """A linearised sampled loop over f [k] in Hz up to the Nyquist frequency, closest where it crosses or resonates.

    `closed` is reference -> controlled signal, `sensitivity` 1/(1 + L) at the command. An unstable loop has no margins:
    its gain and phase margin, Ms, closed loop and sensitivity are None. `margins` says where they come from: sines
    give no closed loop, and where they give no margins, whether the loop is stable may be None too.
    """

    stable: bool | None
    f: np.ndarray
    open: np.ndarray
    closed: np.ndarray | None
    sensitivity: np.ndarray | None
    gain_margin_db: float | None
    phase_margin_deg: float | None
    ms: float | None
    margins: Source = "linear"


def linear_loop(
    plant: Plant, about: Equilibrium, controller: Controller, period: float, p: np.ndarray | None = None
) -> LinearLoop:
    """Close a controller's linear view on the plant linearised at a point, held and sampled every `period` [s].

    A delay of the plant's command counts, exactly. For several designs on one plant, see `linear_loop_on`.
    """
    return linear_loop_on(plant_response(plant, about, period, p), controller)


def linear_loop_on(sampled: PlantResponse, controller: Controller) -> LinearLoop:
    """Close a controller's linear view on a `plant_response`: several designs share what is the plant's."""
    law = linear_view(controller, sampled.signals)
    poles, form, rows = _poles(sampled, law), schur_form(transposed(law)), sampled.rows(law.input_labels[1:])

    def with_law(z: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """Open loop, and reference -> controlled signal without the loop, [2, k]."""
        gains = form.outputs(form.states(z))[:, 0]
        return np.stack((-np.sum(gains[1:] * measured, axis=0), gains[0] * measured[0]))

    def responses(f: np.ndarray) -> np.ndarray:
        z = np.exp(2j * np.pi * f * sampled.period)
        return with_law(z, sampled.at(z, rows))

    further = near(poles, sampled.period)
    f, first = np.unique(np.append(sampled.f, further), return_index=True)
    values = np.hstack((with_law(sampled.z, sampled.on_grid[rows]), responses(further)))[:, first]
    f, (loop, forward) = refined(responses, f, values, _ROUNDS, _INSIDE)
    if not np.abs(poles).max() < STABLE:
        return LinearLoop(False, f, loop, None, None, None, None, None)
    closed = with_margins(f, loop, "linear")
    return replace(closed, closed=forward * closed.sensitivity)


def with_margins(f: np.ndarray, loop: np.ndarray, margins: Source) -> LinearLoop:
    """A stable loop by its open loop [k], complex, at f [k] in Hz up to Nyquist's, without a closed one."""
    sensitivity = 1 / (1 + loop)
    gain, phase = _gain_margin(loop), _phase_margin(loop)
    return LinearLoop(True, f, loop, None, sensitivity, gain, phase, float(np.abs(sensitivity).max()), margins)


def closed_poles(sampled: PlantResponse, controller: Controller) -> np.ndarray:
    """Poles z [k] of the loop that `linear_loop_on` closes, without the time that its margins take."""
    return _poles(sampled, linear_view(controller, sampled.signals))


def _poles(sampled: PlantResponse, law: StateSpace) -> np.ndarray:
    """Of the closed loop's own matrix; what is measured has not heard of this sample's command yet."""
    a, b = sampled.model.A, sampled.model.B
    c = sampled.model.C[sampled.rows(law.input_labels[1:])]
    closed = np.block([[a + b @ (law.D[:, 1:] @ c), b @ law.C], [law.B[:, 1:] @ c, law.A]])
    return np.linalg.eigvals(closed).astype(complex)


def refined(
    responses: Callable[[np.ndarray], np.ndarray], f: np.ndarray, values: np.ndarray, rounds: int, inside: int
) -> tuple[np.ndarray, np.ndarray]:
    """The grid f [k] with more points where the loop, values[0], crosses unit gain or the real axis, and about peaks.

    Each round splits such intervals by `inside` points; `responses` gives values [.., n] at n further frequencies.
    """
    part = np.arange(1, inside + 1) / (inside + 1)
    for _ in range(rounds):
        split = _eventful(values[0])
        more = (f[split, None] * (f[split + 1] / f[split])[:, None] ** part).ravel()
        f, values = np.append(f, more), np.hstack((values, responses(more)))
        order = np.argsort(f, kind="stable")  # quick: two sorted parts
        f, values = f[order], values[:, order]
    return f, values


def _eventful(loop: np.ndarray) -> np.ndarray:
    """Intervals [n] of [k] in which the loop crosses unit gain or the real axis, and both beside extremes of |L| and
    |1 + L|."""
    size = np.abs((loop, 1 + loop))
    rises = np.diff(size) >= 0
    turns = (rises[:, 1:] != rises[:, :-1]).any(axis=0)
    large, upper = size[0] >= 1, np.imag(loop) >= 0
    events = (large[1:] != large[:-1]) | (upper[1:] != upper[:-1])
    events[:-1] |= turns
    events[1:] |= turns
    return np.flatnonzero(events)


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
