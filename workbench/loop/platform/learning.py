"""Learning of a platform's drive file, in all six axes at once.

After each time that the same motion is played, the poses asked for u become Q (u + L e): e is the error of the pose
that the legs' sensors tell, L the inverse of the measured response G, Q a low pass of no phase. What an iteration
leaves of a drive's error is Q (I - L G), at each frequency a matrix: the drive converges where its spectral radius is
below 1, and comes nearer each time where its largest singular value is.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...control.platform_controller import LEGS, PlatformController, PlatformSpec
from ..learning import (
    BOUND,
    CUTOFFS,
    FAINT,
    LOWEST,
    Iteration,
    Learned,
    from_spectrum,
    learn,
    low_pass,
    record_frequencies,
    spectrum,
)
from ..metrics import chamber_row
from ..repeated_record import noise_seed
from ..step_metrics import saturated_time
from .loop import run_platform
from .measured import MatrixResponse, measured_pose
from .setup import PlatformSetup
from .transfer import platform_transfer

DRAWS = 200  # of the measured response, as its deviations have it
SURE = 0.95  # of them
_ENERGY = 0.999  # of the acceleration
_BEYOND = 1.5  # times the frequency up to which the motion has it: Q passes 96 % there


@dataclass(frozen=True, eq=False)
class MatrixFilter:
    """L [k, 6, 6] and Q [k] on the frequencies f [k] Hz of a record of `samples` with its padding; `cutoff` [Hz] is
    that of Q. Drives and errors are metres at the joints."""

    f: np.ndarray
    inverse: np.ndarray
    q: np.ndarray
    cutoff: float
    samples: int

    def corrected(self, drive: np.ndarray, error: np.ndarray, gain: float = 1.0) -> np.ndarray:
        """The next drive [samples, 6] from the last one and the error that it left in the band of Q."""
        u, e = (spectrum(values.T, len(self.f)) for values in (drive, error))
        lines = self.q * u + np.einsum("kij,jk->ik", self.inverse, e)
        return drive + gain * (from_spectrum(lines, self.samples).T - drive)

    def in_band(self, values: np.ndarray) -> np.ndarray:
        """Values [k, 6] behind Q."""
        return from_spectrum(self.q * spectrum(values.T, len(self.f)), len(values)).T


@dataclass(frozen=True, eq=False)
class Left:
    """What an iteration leaves without Q, at the lines of a measurement: spectral `radius` and largest singular value
    `norm` [k] of I - L G."""

    radius: np.ndarray
    norm: np.ndarray

    @classmethod
    def of(cls, inverse: np.ndarray, response: np.ndarray) -> "Left":
        """What inverses L of responses G leave, both [k, 6, 6]."""
        left = np.eye(LEGS) - inverse @ response
        return cls(np.abs(np.linalg.eigvals(left)).max(axis=-1), np.linalg.norm(left, 2, axis=(-2, -1)))


def inverted(response: np.ndarray) -> np.ndarray:
    """L [k, 6, 6] of responses: least squares of I - L G with a penalty, so that what is faint is not inverted."""
    adjoint = np.swapaxes(response.conj(), -1, -2)
    return np.linalg.solve(adjoint @ response + FAINT**2 * np.eye(LEGS), adjoint)


def measured_left(measured: MatrixResponse) -> Left:
    """Radius and norm that 95 % of the responses stay below which the measurement leaves possible."""
    inverse = inverted(measured.response)
    drawn = [Left.of(inverse, response) for response in measured.drawn(DRAWS)]
    return Left(*(np.quantile([getattr(each, key) for each in drawn], SURE, axis=0) for key in ("radius", "norm")))


def other_left(measured: MatrixResponse, declared: np.ndarray, other: np.ndarray) -> Left:
    """What is left with another payload: the measured response changes as the linear model says, from its response
    `declared` to the `other` [k, 6, 6]."""
    changed = other @ np.linalg.inv(declared) @ measured.response
    return Left.of(inverted(measured.response), changed)


def matrix_filter(reference: np.ndarray, period: float, measured: MatrixResponse, left: Sequence[Left]) -> MatrixFilter:
    """For a motion [samples, 6], m at the joints. Q has the highest cut-off with which the norm of Q (I - L G) stays
    below 0.9 on all that may be `left`, and that the motion asks for: beyond it only noise would be learned."""
    f = record_frequencies(len(reference), period)
    worst = np.max([each.norm for each in left], axis=0)
    cutoffs = np.geomspace(min(measured.f[-1], _asked(reference, f)), LOWEST, CUTOFFS)
    fits = (cutoff for cutoff in cutoffs if (low_pass(measured.f, cutoff) * worst).max() < BOUND)
    cutoff = float(next(fits, LOWEST))
    return MatrixFilter(f, inverted(measured.at(f).response), low_pass(f, cutoff), cutoff, len(reference))


def _asked(reference: np.ndarray, f: np.ndarray) -> float:
    """The cut-off [Hz] that passes the frequency below which a motion has nearly all energy of its acceleration."""
    energy = np.cumsum(np.sum(np.abs(f**2 * spectrum(reference.T, len(f))) ** 2, axis=0))
    return _BEYOND * float(f[np.searchsorted(energy, _ENERGY * energy[-1])])


def learn_motion(
    learning: MatrixFilter, reference: np.ndarray, play: Callable[[int, np.ndarray, float], Iteration], most: int
) -> Learned:
    """Learn a drive for a motion [samples, 6]. What is measured of an iteration differs from the motion by the error in
    the band of Q alone: the sensors' noise beyond it is no error that a drive could mend."""

    def in_band(number: int, drive: np.ndarray, gain: float) -> Iteration:
        iteration = play(number, drive, gain)
        wanted = reference[: len(iteration.measured)]
        return replace(iteration, measured=wanted + learning.in_band(iteration.measured - wanted))

    return learn(learning, reference, in_band, most)


@dataclass(frozen=True)
class RepeatedMotion:
    """A controller that plays drives of a platform from home; `seed` is that of its sensors' noise."""

    setup: PlatformSetup
    controller: PlatformController
    seed: int | None

    @classmethod
    def of(cls, spec: PlatformSpec, setup: PlatformSetup, seed: int | None) -> "RepeatedMotion":
        """The motion repeated by a controller on a platform."""
        return cls(setup, spec.build(setup.platform.period, setup.directions), seed)

    def play(self, number: int, drive: np.ndarray, gain: float) -> Iteration:
        """The nth time, from -1: another drive [k, 6], m at the joints, and other noise."""
        seed, weights = noise_seed(self.seed, number), self.setup.platform.geometry.weights
        run = run_platform(self.setup, self.controller, drive / weights, seed)
        limited = max(saturated_time(run.t, run.demanded[:, i], run.sent[:, i]) for i in range(LEGS))
        return Iteration(
            drive,
            run.pose * weights,
            measured_pose(self.setup, self.controller, run, seed) * weights,
            run.sent,
            limited,
            chamber_row(run.t, run.signals["lowest_pressure"]),
            run.tripped,
            gain,
        )

    def transfer(self, f: np.ndarray) -> np.ndarray | None:
        """The linear response [k, 6, 6] at home; None where the loop is unstable."""
        transfer = platform_transfer(self.setup, self.controller, f)
        return transfer.transfer if transfer.stable else None


@dataclass(frozen=True)
class PayloadDraw:
    """Payloads that are drawn: how many, factors on the mass with all moments of inertia, further factors on each
    moment, and how far [m] the centre may be from the declared one along each axis."""

    plants: int
    mass: tuple[float, float]
    inertia: tuple[float, float]
    centre: float

    def draw(self, setup: PlatformSetup, seed: int) -> list[dict[str, float]]:
        """Numbers of the payload by name, SI."""
        platform, random = setup.platform, np.random.default_rng(seed)
        payloads = []
        for _ in range(self.plants):
            factor = random.uniform(*self.mass)
            values = {"mass": factor * platform["mass"]}
            values |= {name: factor * random.uniform(*self.inertia) * platform[name] for name in ("Ixx", "Iyy", "Izz")}
            values |= {name: platform[name] + random.uniform(-self.centre, self.centre) for name in ("cx", "cy", "cz")}
            payloads.append(values)
        return payloads


def acceleration_error(learning: MatrixFilter, error: np.ndarray) -> np.ndarray:
    """Accelerations [samples, 6] that belong to an error of the pose [samples, 6], in the band of Q."""
    lines = -((2 * np.pi * learning.f) ** 2) * learning.q * spectrum(error.T, len(learning.f))
    return from_spectrum(lines, len(error)).T
