"""Amplitude and phase control of a sine: the reference that a loop needs so that its position is the sine asked for.

    r' = Re(G z + c3 z^3/|z|^2 + c5 z^5/|z|^4),  z = A e^(jwt) of a reference r = A cos(wt)

G makes up for the loop's gain and lag at the frequency w, c3 and c5 take out the odd harmonics that a symmetric
nonlinearity makes. Block by block the loop is given time to settle; then least squares on whole cycles, with a line for
drift, give the amplitudes Y1, Y3, Y5 of the position in terms of z, and

    G+ = G (1 + g (1/Y1 - 1)),  ck+ = ck - g Yk/T^,  g = E^2/(E^2 + s^2)

where E is the error, |1 - Y1| or |Yk|, and s twice what the sensor's noise makes of it, so that this is corrected
little. Y1/G is the loop's measured response: on a linear loop that has settled G arrives in one block, whatever it
started from. A harmonic converges where |1 - g T/T^| < 1, T the loop's response at it and T^ what it is taken for,
which starts from a linear view and goes on by secants, what c did to Y over its change (Pigg and Bodson, Adaptive
algorithms for the rejection of sinusoidal disturbances acting on unknown plants, IEEE Trans. Control Systems Technology
18(4), 2010; Bodson, Sacks and Khosla, Harmonic generation in adaptive feedforward cancellation schemes, IEEE Trans.
Automatic Control 39(9), 1994).
"""

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..engine import lazy_casadi as ca
from ..linear.state_space import StateSpace, transfer_function, tustin
from .shell import Passed, Shell, Signals

_DAMPING = 0.5  # of the band-pass that splits the reference: it settles in a cycle
_SIGMAS = 2.0  # of the noise: an error as large is corrected by half
_MOST = 4.0  # times what the loop's response asks for: no larger drive is tried
_STEP = 2.0  # largest factor by which a block changes the drive
_HARMONIC = 0.3  # of the sine: no larger part of a harmonic is added
_FAINT = 1e-9  # m: amplitudes below are none
_ALIASED = 0.4  # of the control rate: higher harmonics are not measured
_COARSE = 0.03  # error of the sine above which its harmonics wait


@dataclass(eq=False)
class SineControl(Shell):
    """Control of sines of a `frequency` [Hz] by a loop whose `responses` are complex there, and at 3, 5 .. times it.

    settle, measure: s of a block; `noise`: standard deviation of the position sensor [m]; at a `period` [s]. Raises
    InputError for a frequency, or a harmonic of it, above half the control rate.
    """

    frequency: float
    responses: tuple[complex, ...]
    settle: float
    measure: float
    noise: float
    period: float

    def __post_init__(self) -> None:
        highest = self.frequency * (2 * len(self.responses) - 1)
        if highest * self.period >= 0.5:
            raise InputError(f"frequency: {highest:g} Hz with its harmonics is above half the control rate; lower it")
        # two of the band-pass, the sample in the block, sums of reference and position, and what is learned
        self.names = tuple(f"plan_{i}" for i in range(6 + 2 * self._sums + 8 * (len(self.orders) - 1)))
        self.numbers = self._numbers()

    leads = True

    @property
    def key(self) -> Hashable:
        return "sine control", len(self.names), len(self.numbers)

    def measures(self, inner: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*inner, "position")))

    @property
    def orders(self) -> tuple[int, ...]:
        """The orders of the sine and the harmonics."""
        return tuple(range(1, 2 * len(self.responses), 2))

    @cached_property
    def _measured_orders(self) -> tuple[int, ...]:
        """Orders that are measured, whether or not they are taken out: one that is not would pass for drift."""
        return tuple(k for k in (1, 3, 5) if k in self.orders or k * self.frequency * self.period < _ALIASED)

    @cached_property
    def _samples(self) -> tuple[int, int]:
        """The samples of a block: those in which it settles, and those that are measured, whole cycles."""
        cycle = 1 / (self.frequency * self.period)
        cycles = max(1, np.ceil(self.measure / self.period / cycle - 1e-9))
        return round(self.settle / self.period), round(cycles * cycle)

    @property
    def _sums(self) -> int:
        """How many sums a signal is measured by: level, drift, and two an order."""
        return 2 + 2 * len(self._measured_orders)

    @cached_property
    def _band(self) -> StateSpace:
        """From the reference to Re z, and to -Im z, which leads it by a quarter: exact at the frequency."""
        w = 2 / self.period * np.tan(np.pi * self.frequency * self.period)
        width = 2 * _DAMPING * w
        denominator = [1, width, w**2]
        (a, b, c, d), (_, _, lead, direct) = (
            tustin(transfer_function(top, denominator), self.period) for top in ([width, 0], [width / w, 0, 0])
        )
        return StateSpace(a, b, np.vstack((c, lead)), np.vstack((d, direct)), self.period, ["reference"], ["p", "q"])

    def rest(self, s: Signals, u: "ca.SX") -> "ca.SX":
        """Nothing measured, G by the loop's response."""
        band, start = self._band, 1 / self.responses[0]
        x = ca.DM(np.linalg.solve(np.eye(2) - band.A, band.B[:, 0])) * s["reference"]
        learned = [(0, 0, 0, 0, 0, 0, inverse.real, inverse.imag) for inverse in 1 / np.array(self.responses[1:])]
        known = np.concatenate((np.zeros(1 + 2 * self._sums), (start.real, start.imag, 0.0), *learned))
        return ca.vertcat(x, ca.DM(known))

    def _numbers(self) -> np.ndarray:
        """The band-pass; turn a sample, samples, noise, largest |G|; the inverse of the sums' squares."""
        settling, measured = self._samples
        n = settling + np.arange(measured)
        turn, most = 2 * np.pi * self.frequency * self.period, _MOST / abs(self.responses[0])
        rows = np.array(self._basis(np, n, turn, settling, measured))
        band, squares = (part.ravel() for part in self._band.matrices), np.linalg.inv(rows @ rows.T)
        sigma = _SIGMAS * self.noise * np.sqrt(squares[2, 2] + squares[3, 3])
        return np.concatenate((*band, (turn, settling, measured, sigma, most), squares.ravel()))

    def _basis(self, of: Any, n: Any, turn: Any, settling: Any, measured: Any) -> list[Any]:
        """Level, drift, and cosine and sine of every order at sample n of a block, by `of.cos` and `of.sin`."""
        waves = [wave(order * turn * n) for order in self._measured_orders for wave in (of.cos, of.sin)]
        return [1.0 + 0 * n, (n - settling) / measured - 0.5, *waves]

    def _split(self, q: "ca.SX") -> list["ca.SX"]:
        """Matrices of the band-pass, numbers of the block, inverse of the sums' squares."""
        sizes = [4, 2, 4, 2, 5, self._sums**2]
        return [q[first:last] for first, last in pairwise(np.cumsum([0, *sizes]).tolist())]

    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        """The loop's reference."""
        _, _, c, d, *_ = self._split(q)
        split = ca.reshape(c, 2, 2).T @ w[:2] + d * s["reference"]
        z, learned = _conjugate(split), w[3 + 2 * self._sums :]
        direction = _times(z, z) / (ca.sumsqr(z) + _FAINT**2)
        reference = s["reference"] - z[0]
        for part in (learned[:2], *(part[:2] for part in self._by_order(learned))):
            reference += _times(part, z)[0]
            z = _times(z, direction)
        return Passed({"reference": reference})

    def after(self, w: "ca.SX", s: Signals, v: "ca.SX", q: "ca.SX") -> "ca.SX":
        a, b, _, _, block, *_ = self._split(q)
        turn, settling, measured, *_ = ca.vertsplit(block)
        n, size, signals = w[2], self._sums, (s["reference"], s["position"])
        basis = ca.vertcat(*self._basis(ca, n, turn, settling, measured))
        sums = [
            ca.if_else(n < settling, 0, w[3 + i * size : 3 + (i + 1) * size] + basis * signal)
            for i, signal in enumerate(signals)
        ]
        over, learned = n >= settling + measured - 1, w[3 + 2 * size :]
        counted = ca.if_else(over, 0, ca.floor(n) + 1)
        after = ca.if_else(over, self._learned(learned, sums, q), learned)
        return ca.vertcat(ca.reshape(a, 2, 2).T @ w[:2] + b * s["reference"], counted, *sums, after)

    def _by_order(self, learned: "ca.SX") -> list["ca.SX"]:
        """What was learned of each harmonic: c, its last change, what was left of the harmonic before, 1/T^."""
        return [learned[3 + 8 * k : 11 + 8 * k] for k in range(len(self.orders) - 1)]

    def _learned(self, learned: "ca.SX", sums: list["ca.SX"], q: "ca.SX") -> "ca.SX":
        """G, how steady the sine is, and what is learned of the harmonics, after a block."""
        *_, block, squares = self._split(q)
        squares = ca.reshape(squares, self._sums, self._sums)
        asked, done = (squares @ each for each in sums)
        r = _conjugate(asked[2:4])
        size = ca.sumsqr(r) + _FAINT**2
        noise, most = block[3] ** 2 / size, block[4]
        turned = _conjugate(r) / size  # |R|^(k-1)/R^k, first of the sine itself
        back = _times(_conjugate(r), _conjugate(r)) / size
        parts, steady = self._sine(learned[:2], _times(_conjugate(done[2:4]), turned), noise, most)
        parts, trusted = [parts, steady], steady * learned[2]
        for k, old in enumerate(self._by_order(learned), 1):
            turned = _times(turned, back)
            harmonic = _times(_conjugate(done[2 + 2 * k : 4 + 2 * k]), turned)
            parts.append(_harmonic(old, harmonic, noise, most, steady, trusted))
        return ca.if_else(size > (10 * _FAINT) ** 2, ca.vertcat(*parts), learned)

    def _sine(self, gain: "ca.SX", there: "ca.SX", noise: "ca.SX", most: "ca.SX") -> tuple["ca.SX", "ca.SX"]:
        """G after a block in which the position was `there` times what was asked for, and whether that is near 1."""
        error = ca.sumsqr(there - _one())
        step = _limited(_conjugate(there) / (ca.sumsqr(there) + _FAINT**2), _STEP)
        g = error / (error + noise + _FAINT**2)
        return _limited(_times(gain, _one() + g * (step - _one())), most), 1 / (1 + error / _COARSE**2)


def _harmonic(
    old: "ca.SX", harmonic: "ca.SX", noise: "ca.SX", most: "ca.SX", steady: "ca.SX", trusted: "ca.SX"
) -> "ca.SX":
    """What is learned of a harmonic; its secant counts as far as the sine was `trusted` in both blocks."""
    c, change, before, inverse = (old[2 * i : 2 * i + 2] for i in range(4))
    moved = harmonic - before
    power = ca.sumsqr(moved)
    share = trusted * power / (power + 2 * noise + _FAINT**2)
    secant = _times(change, _conjugate(moved)) / (power + _FAINT**2)
    inverse += share * (secant - inverse)
    g = steady * ca.sumsqr(harmonic) / (ca.sumsqr(harmonic) + noise + _FAINT**2)
    after = _limited(c - g * _times(harmonic, inverse), _HARMONIC * most)
    return ca.vertcat(after, after - c, harmonic, inverse)


def _one() -> "ca.SX":
    return ca.SX([1.0, 0.0])


def _times(a: "ca.SX", b: "ca.SX") -> "ca.SX":
    """The product of two complex numbers [2]."""
    return ca.vertcat(a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0])


def _conjugate(a: "ca.SX") -> "ca.SX":
    return ca.vertcat(a[0], -a[1])


def _limited(a: "ca.SX", most: "ca.SX | float") -> "ca.SX":
    """A complex number [2] of a size at most."""
    return a * ca.fmin(1, most / ca.sqrt(ca.sumsqr(a) + _FAINT**2))
