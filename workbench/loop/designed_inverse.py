"""A designed inverse before a loop: a finite filter of the reference that undoes the closed loop's lag and gain. And a
loop that closes through its reference, as in hybrid simulation: what is measured comes back into the reference.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from scipy.linalg import solve_toeplitz

from ..base.errors import InputError, nearest
from ..control.protocol import Controller, linear_view
from ..linear.interconnect import feedback, select, series
from ..linear.state_space import StateSpace
from .margins import STABLE, LinearLoop, with_margins
from .open_loops import near, opened, unit_circle
from .sampled_lanes import LaneResponse, SampledLanes

FAINT = 0.01  # of a closed loop's gain: what is fainter is not inverted
BAND = 5.0  # Hz: within which references move
_LINES = 2**15  # frequencies up to Nyquist's, for the integrals


@dataclass(frozen=True, eq=False)
class ReferenceInverse:
    """H(z) = sum of taps[j] z^(preview - j), taps [n], at a `period` [s]: it looks `preview` samples ahead.

    Where the reference is known, `filtered` makes a drive file of it. As a compensator of a reference that is not, it
    is as late as it looks ahead.
    """

    into: ClassVar[Literal["reference"]] = "reference"
    taps: np.ndarray
    preview: int
    period: float

    def filtered(self, reference: np.ndarray) -> np.ndarray:
        """The drive [k] for a reference [k], which stands before it begins and after it ends."""
        after = len(self.taps) - 1 - self.preview
        whole = np.pad(reference, (after, self.preview), mode="edge")
        return np.convolve(whole, self.taps, mode="valid")

    def response(self, f: np.ndarray) -> np.ndarray:
        """H, complex [k], at frequencies f [k] Hz."""
        z = np.exp(2j * np.pi * f * self.period)
        return z**self.preview * np.polynomial.polynomial.polyval(1 / z, self.taps)

    def left(self, loop: LinearLoop) -> np.ndarray:
        """1 - H T, complex [k] at a stable loop's f: what is left of a reference as its error."""
        return 1 - self.response(loop.f) * loop.closed if loop.closed is not None else np.full(len(loop.f), np.nan)

    @property
    def law(self) -> StateSpace:
        """H late by its preview, with the last references as its states."""
        n = len(self.taps) - 1
        leaving, direct = self.taps[None, 1:], self.taps[None, :1]
        return StateSpace(np.eye(n, k=-1), np.eye(n, 1), leaving, direct, self.period, ["reference"], ["reference"])


def designed_inverse(
    loops: Sequence[LinearLoop], period: float, preview: int, taps: int, band: float = BAND
) -> ReferenceInverse:
    """The filter of so many taps with the least squares of 1 - H T over all loops and frequencies, H(1) being 1.

    Squares count as references do, whose spectrum falls as 1/f^4 above the `band` [Hz]; 0.01^2 |H|^2 is added to them,
    so that what the loops hardly pass is not blown up. With enough preview H T of one loop is real and positive, as in
    zero phase error tracking (Tomizuka, J. Dyn. Syst. Meas. Control 109, 1987), and as near to 1 as that sum allows.
    Tomizuka's leaves H T = prod |z - z_i|^2/(1 - z_i)^2 over the zeros z_i outside the unit circle, with gains that
    nothing bounds: for `p-dp` of position_tuned.toml on jack-10t, whose z_i are sampling zeros at -1.9 and beyond, an
    error of 0.3 % of a reference at 15 Hz, where least squares leave 19 %, and a gain of 320 at 60 Hz, where they have
    0.06.
    Raises InputError for a preview outside of the taps, and for a loop that is unstable or has no linear view.
    """
    if not 0 <= preview < taps:
        raise InputError(f"preview of {preview} samples: must be 0 or more, below the {taps} taps")
    f = np.linspace(0.0, 0.5 / period, _LINES + 1)
    closed = [loop.closed for loop in loops if loop.closed is not None]
    if len(closed) < len(loops):
        raise InputError("a loop to invert is unstable or has no linear view; leave it out")
    responses = np.array([np.interp(f, loop.f, t) for loop, t in zip(loops, closed, strict=True)])
    weight = 1 / (1 + (f / band) ** 4)
    power = np.fft.irfft(weight * np.mean(np.abs(responses) ** 2, axis=0) + FAINT**2)
    wanted = np.fft.irfft(weight * np.mean(responses.conj(), axis=0))[np.arange(taps) - preview]
    free, level = solve_toeplitz(power[:taps], np.column_stack((wanted, np.ones(taps)))).T
    return ReferenceInverse(free + level * (1 - free.sum()) / level.sum(), preview, period)


def outer_loop(
    sampled: SampledLanes, controller: Controller, outer: StateSpace, inverse: ReferenceInverse | None = None
) -> LinearLoop:
    """The loop of a controller on a plant, opened at the reference: r = H(z) G(z) y.

    G, `outer`, is a discrete system from measured signals, such as "force", to "reference", both as deviations; H is an
    inverse before the loop, late by its preview. Margins are those of -H G T, T from the reference to the signals;
    whether it is stable comes from the poles of both loops together. Nothing of it shows in the margins of the inner
    loop.
    Raises InputError for a G of other signals or of another period.
    """
    _check(outer, sampled)
    law = linear_view(controller, sampled.point)
    signals = list(dict.fromkeys((*law.input_labels[1:], *outer.input_labels)))
    inner = feedback(select(sampled.model, ["command"], signals), law)
    through = outer if inverse is None else series(outer, inverse.law)
    inner = select(inner, ["reference"], list(through.input_labels))
    both = feedback(inner, through).poles()
    once = select(series(inner, through), ["reference"], ["reference"])
    response = LaneResponse.of(once.A[None], once.B[None, :, 0], once.C[None], once.D[None, :, 0])

    def at(_lanes: np.ndarray, f: np.ndarray) -> np.ndarray:
        return -response.at(unit_circle(f, sampled.period))[:, 0]

    poles = np.concatenate((both, inner.poles(), sampled.response.modes[0]))
    f = np.sort(np.append(sampled.f, near(poles[None], sampled.period)))[None]
    return with_margins(opened(at, f, at(np.zeros(1, int), f)), bool(np.abs(both).max() < STABLE), "linear")


def _check(outer: StateSpace, sampled: SampledLanes) -> None:
    known = sampled.measures
    if unknown := [name for name in outer.input_labels if name not in known]:
        raise InputError(f'outer loop: no signal "{unknown[0]}"; {nearest(unknown[0], known)}')
    if outer.output_labels != ["reference"]:
        raise InputError(f'outer loop: gives {", ".join(outer.output_labels)}; make it give "reference"')
    if not np.isclose(outer.dt, sampled.period):
        raise InputError(f"outer loop: its period is {outer.dt:g} s, the rig's {sampled.period:g} s; sample it so")
