"""Sines that a loop follows: amplitude and phase by the cycle, harmonics, and the controller that corrects them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..control.load_class import load_class
from .rows import LinearLoops

ARRIVES, JUDGED = 10, 10  # cycles: in which a sine has to arrive, and over which it is judged then
AMPLITUDE, PHASE = 0.005, 0.5  # of the amplitude, and degrees: a sine within both has arrived
ORDERS = (1, 3, 5)  # that are told apart
ROOM = 0.03  # gain of a loop at a harmonic, from which that is taken out: less would answer to noise
WINDOW = 0.1  # s: amplitudes while it arrives are those of whole cycles that last as long
_USE = "controllers.amplitude_phase:AmplitudePhase"
_ALIASED = 0.4  # of the control rate: higher harmonics are not looked at


@dataclass(frozen=True, eq=False)
class SineErrors:
    """Errors of the amplitude [1] and the phase [rad] of sines [lanes] once they had time to arrive, and the third
    harmonic over the amplitude that is asked for [1]. NaN where a lane did not last."""

    amplitude: np.ndarray
    phase: np.ndarray
    third: np.ndarray

    @property
    def within(self) -> np.ndarray:
        """Whether amplitude and phase have arrived, bool [lanes]."""
        return (np.abs(self.amplitude) <= AMPLITUDE) & (np.abs(self.phase) <= np.radians(PHASE))


def sine(amplitude: float, frequency: float, period: float) -> np.ndarray:
    """A reference [k]: the cycles in which it has to arrive and those over which it is judged."""
    k = round((ARRIVES + JUDGED) / (frequency * period)) + 1
    return amplitude * np.sin(2 * np.pi * frequency * period * np.arange(k))


def harmonics(y: np.ndarray, first: int, last: int, turn: float) -> np.ndarray:
    """Amplitudes, complex [lanes, orders], over those of a sine by least squares of samples first to last of
    y [lanes, k], which turn by so much [rad] each: with a level and a drift."""
    n = np.arange(first, last)
    orders = [k for k in ORDERS if k == 1 or k * turn < 2 * np.pi * _ALIASED]
    basis = [np.ones(len(n)), (n - n.mean()) / len(n)]
    basis += [wave(k * turn * n) for k in orders for wave in (np.sin, np.cos)]
    parts = np.linalg.lstsq(np.array(basis).T, y[:, first:last].T, rcond=None)[0][2:]
    amplitudes = np.zeros((len(y), len(ORDERS)), complex)
    amplitudes[:, : len(orders)] = (parts[::2] + 1j * parts[1::2]).T
    return amplitudes


def sine_errors(y: np.ndarray, amplitude: float, frequency: float, period: float) -> SineErrors:
    """The errors of positions y [lanes, k] that were to follow `sine`, over the cycles in which they are judged."""
    first, last = (round(cycle / (frequency * period)) for cycle in (ARRIVES, ARRIVES + JUDGED))
    lasted = np.isfinite(y).all(axis=1)
    found = np.full((len(y), len(ORDERS)), np.nan, complex)
    found[lasted] = harmonics(y[lasted], first, last, 2 * np.pi * frequency * period) / amplitude
    return SineErrors(np.abs(found[:, 0]) - 1, np.angle(found[:, 0]), np.abs(found[:, 1]))


def arriving(y: np.ndarray, amplitude: float, frequency: float, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Errors of amplitude [1] and phase [rad] of a position y [k] that is to follow `sine`, [cycles] each.

    Those of each cycle and the ones after it that last 0.1 s together.
    """
    cycle = 1 / (frequency * period)
    window = max(1, int(np.ceil(WINDOW * frequency - 1e-9)))
    starts = range((len(y) - 1 - round(window * cycle)) // int(np.ceil(cycle)) + 1)
    found = np.array([
        harmonics(y[None], round(i * cycle), round((i + window) * cycle), 2 * np.pi / cycle)[0, 0] / amplitude
        for i in starts
    ])  # fmt: skip
    return np.abs(found) - 1, np.angle(found)


def cycles_to_arrive(amplitude: np.ndarray, phase: np.ndarray) -> int | None:
    """After so many cycles errors as `arriving` gives them stay within what is asked; None where they do not."""
    out = (np.abs(amplitude) > AMPLITUDE) | (np.abs(phase) > np.radians(PHASE))
    after = int(np.max(np.flatnonzero(out), initial=-1)) + 1
    return after if after < len(out) else None


def responses(loops: LinearLoops, frequency: float, orders: Sequence[int]) -> np.ndarray:
    """The mean response of the closed loops at null and moving to multiples of a frequency [Hz], complex [orders].

    Raises ValueError for a loop that is unstable or has no linear view.
    """
    closed = [(loop.f, loop.closed) for loop in (loops.null, loops.moving) if loop.closed is not None]
    if len(closed) < 2:
        raise ValueError("a loop is unstable or has no linear view")
    return np.mean([np.interp(frequency * np.array(orders), f, response) for f, response in closed], axis=0)


def amplitude_phase(
    spec: ControllerSpec, loops: LinearLoops, frequency: float, highest: int, noise: float
) -> ControllerSpec:
    """A controller with amplitude and phase control around it, for sines of a frequency [Hz] by its linear loops.

    Odd harmonics up to the `highest` order are taken out as far as the loop's gain leaves room. `noise`: standard
    deviation of the position sensor [m]. Raises ValueError as `responses`.
    """
    orders = [k for k in ORDERS if k <= highest]
    at = responses(loops, frequency, orders)
    numbers = {"frequency": frequency, "noise": noise}
    for order, response in zip(orders, at, strict=True):
        if order > 1 and abs(response) < ROOM:
            break
        name = "" if order == 1 else str(order)
        numbers[f"gain{name}"], numbers[f"phase{name}"] = float(np.abs(response)), float(np.degrees(np.angle(response)))
    design = load_class(_USE, "amplitude and phase control").Design(**numbers)
    return spec + ControllerSpec("amplitude-phase", _USE, design)
