"""Nyquist margins of the loop that negative feedback closes around a fractional system, its delay exact."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from ...base.errors import InputError
from ...base.gain_phase import gain_db
from .stability import corner_range, roots_in_sector

if TYPE_CHECKING:
    from .transfer_function import FractionalTransferFunction

_FAINT, _LARGE = 0.02, 50.0  # |L| beyond which 1 + L has the argument of its limit, but for what its phase says
_POINTS = 300  # by the decade
_TURN = 0.05  # rad between neighbours
_HALVINGS = 40
_ON_THE_POINT = 1e-9  # |1 + L| of a closed pole on the imaginary axis


@dataclass(frozen=True)
class FractionalMargins:
    """Whether the closed loop is stable, and how many of its poles are right of the imaginary axis.

    Of a stable one Ms, the least gain margin [dB] and the least phase margin [deg] in either direction, and the `delay`
    [s] that it bears besides its own; None where no crossing limits it.
    """

    stable: bool
    unstable: int
    ms: float | None = None
    gain_margin_db: float | None = None
    phase_margin_deg: float | None = None
    delay: float | None = None


def nyquist_margins(system: "FractionalTransferFunction") -> FractionalMargins:
    """Margins of L by the argument principle: closed poles Z = P + a/2 - turn/pi, P those of L in the right half plane,
    a the order of its pole at 0, and turn that of 1 + L along s = j w from 0 to infinity.

    Raises InputError for a system with as many zeros as poles, or with a pole on the imaginary axis.
    """
    above, below = system.numerator, system.denominator
    if not above.terms or above.highest >= below.highest:
        raise InputError(f"{system}: margins need a numerator of a lower order, and not 0")
    poles = roots_in_sector(below, np.pi / 2)
    if poles is None:
        raise InputError(f"{system}: a pole on the imaginary axis, within rounding; margins need none")
    x = _grid(system)
    loop = system(1j * np.exp(x))
    if np.abs(1 + loop).min() < _ON_THE_POINT:
        return FractionalMargins(False, 0)
    start = 1 + loop[0]
    if below.lowest:  # the argument that L has there, and 1 + L with it
        start = np.sign(above.terms[0][1] / below.terms[0][1]) * 1j ** -float(below.lowest)
    around = np.concatenate(([start], 1 + loop, [1.0]))
    turn = np.angle(around[1:] / around[:-1]).sum()
    unstable = round(poles + float(below.lowest) / 2 - turn / np.pi)
    return _margins(system, x, loop) if not unstable else FractionalMargins(False, unstable)


def _margins(system: "FractionalTransferFunction", x: np.ndarray, loop: np.ndarray) -> FractionalMargins:
    """Margins of a stable loop [k] at ln w [k], with each crossing where the exact response has it."""

    def at(log_w: float) -> complex:
        return complex(system(1j * np.exp(log_w)))

    crossovers = _zeros(lambda log_w: np.log(abs(at(log_w))), x, np.log(np.abs(loop)))
    phases = [np.angle(-at(log_w)) for log_w in crossovers]
    gains = np.array([at(log_w).real for log_w in _zeros(lambda log_w: at(log_w).imag, x, np.imag(loop))])
    delays = [phase % (2 * np.pi) / np.exp(log_w) for phase, log_w in zip(phases, crossovers, strict=True)]
    return FractionalMargins(
        True,
        0,
        float(1 / np.abs(1 + loop).min()),
        min(np.abs(gain_db(gains[gains < 0])).tolist(), default=None),
        min((float(np.degrees(abs(phase))) for phase in phases), default=None),
        min((float(delay) for delay in delays), default=None),
    )


def _grid(system: "FractionalTransferFunction") -> np.ndarray:
    """ln w [k] from where the lowest terms rule to where the loop is faint, fine enough for the turn of 1 + L."""
    ranges = [corner_range(part) for part in (system.numerator, system.denominator)]
    late = np.log(1 / system.delay) if system.delay else np.inf
    low, high = min(*(pair[0] for pair in ranges), late - 7), max(pair[1] for pair in ranges)
    while abs(system(1j * np.exp(high))) > _FAINT:
        high += 1.0
    while system.denominator.lowest and abs(system(1j * np.exp(low))) < _LARGE:
        low -= 1.0
    x = np.linspace(low, high, int(_POINTS * (high - low) / np.log(10)) + 2)
    for _ in range(_HALVINGS):
        around = 1 + system(1j * np.exp(x))
        coarse = np.abs(np.angle(around[1:] / around[:-1])) > _TURN
        if not coarse.any():
            break
        x = np.sort(np.append(x, (x[:-1] + x[1:])[coarse] / 2))
    return x


def _zeros(function: Callable[[float], float], x: np.ndarray, values: np.ndarray) -> list[float]:
    """The x at which a function of values [k] at x [k] changes its sign."""
    from scipy.optimize import brentq

    places = np.flatnonzero(np.signbit(values[1:]) != np.signbit(values[:-1]))
    return [cast(float, brentq(function, x[i], x[i + 1], xtol=1e-13)) for i in places]
