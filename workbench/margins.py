"""The sampled loop, linearised: closed loop, sensitivity and margins, or the plain word that it is unstable."""

from dataclasses import dataclass

import control
import numpy as np

from .controller import Controller
from .plant import Plant
from .response import decibels
from .views import Equilibrium, linearise

_LOWEST = 1e-4  # Hz: crossings of the slowest loop that any controller allows
_POINTS = 4000


@dataclass(frozen=True)
class LinearLoop:
    """A linearised sampled loop over f [k] in Hz up to the Nyquist frequency.

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


def linear_loop(
    plant: Plant, about: Equilibrium, controller: Controller, period: float, p: np.ndarray | None = None
) -> LinearLoop:
    """Close a controller's linear view on the plant linearised at a point, held and sampled every `period` [s]."""
    model = linearise(plant, about, ("command",), controller.measures, p)
    sampled = control.c2d(model, period, "zoh")
    law = controller.linear()
    stable = bool(np.abs(np.linalg.eigvals(_closed_matrix(sampled, law))).max() < 1 - 1e-9)
    f = np.geomspace(_LOWEST, 0.4999 / period, _POINTS)
    z = np.exp(2j * np.pi * f * period)
    response = np.asarray(sampled(z)).reshape(len(controller.measures), -1)
    gains = np.asarray(law(z)).reshape(1 + len(controller.measures), -1)
    loop = -np.sum(gains[1:] * response, axis=0)
    if not stable:
        return LinearLoop(False, f, loop, None, None, None, None, None)
    sensitivity = 1 / (1 + loop)
    gain_margin, phase_margin = _margins(loop, f)
    closed = gains[0] * response[0] * sensitivity
    return LinearLoop(True, f, loop, closed, sensitivity, gain_margin, phase_margin, float(np.abs(sensitivity).max()))


def _closed_matrix(plant: control.StateSpace, law: control.StateSpace) -> np.ndarray:
    """State matrix of plant and controller in closed loop (the measured signals do not answer the command at once)."""
    a, b, c = (np.asarray(part) for part in (plant.A, plant.B, plant.C))
    ac, bc, cc, dc = (np.asarray(part) for part in (law.A, law.B, law.C, law.D))
    return np.block([[a + b @ dc[:, 1:] @ c, b @ cc], [bc[:, 1:] @ c, ac]])


def _margins(loop: np.ndarray, f: np.ndarray) -> tuple[float | None, float | None]:
    """Least gain margin [dB] in either direction and least phase margin [deg]; None where there is no crossing."""
    phase = np.degrees(np.unwrap(np.angle(loop)))
    gains, phases, *_ = control.stability_margins((np.abs(loop), phase, 2 * np.pi * f), returnall=True)
    gain = min((abs(float(decibels(np.array(g)))) for g in gains if g > 0), default=None)
    return gain, min((abs(float(value)) for value in phases), default=None)
