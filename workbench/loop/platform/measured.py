"""The 6 x 6 response of a platform's loop as it is measured: from the pose asked for to the pose that its legs' sensors
tell.

Six experiments of one realization move all axes at once, with phases that differ from one to the next by whole sixths
of a turn, so that the six answers solve for all 36 entries; each then has a sixth of the variance that it has where one
axis moves at a time (Dobrowiecki and Schoukens, Measuring a linear approximation to weakly nonlinear MIMO systems,
Automatica 43(10), 2007). Other realizations have other phases: what differs between them is noise and what is not
linear.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...control.platform_controller import LEGS, PlatformController
from ...records.excitation import MultisineSpec, harmonics
from .compiled import LegSensors
from .loop import PlatformRun, run_platform
from .poses import REST
from .record import check_motion
from .setup import PlatformSetup

REALIZATIONS = 4
_POOLED = 5  # lines, over which a deviation is averaged
_FIRST = 1000  # of the seeds of noise: others than those of the records that are learned
_PHASES = 2  # of the draw of phases


@dataclass(frozen=True, eq=False)
class MatrixResponse:
    """Responses [k, 6, 6] of the pose (rows) to the pose asked for (columns) at f [k] Hz, angles times the radius of
    the joints, and the standard deviation [k, 6, 6] of each complex entry."""

    f: np.ndarray
    response: np.ndarray
    deviation: np.ndarray

    def at(self, f: np.ndarray) -> "MatrixResponse":
        """At other frequencies, between the lines; real at 0, and held beyond the last line."""
        known = np.concatenate(([0.0], self.f))
        parts = [np.concatenate((np.real(each[:1]), each)) for each in (self.response, self.deviation)]
        response, deviation = (_between(f, known, part) for part in parts)
        return MatrixResponse(f, response, np.real(deviation))

    def drawn(self, count: int, seed: int = 0) -> Iterator[np.ndarray]:
        """Responses [k, 6, 6] as they may truly be, `count` of them."""
        normal = np.random.default_rng(seed)
        for _ in range(count):
            real, imaginary = normal.standard_normal((2, *self.response.shape)) / np.sqrt(2)
            yield self.response + self.deviation * (real + 1j * imaginary)


def _between(f: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    flat = values.reshape(len(known), -1)
    columns = [np.interp(f, known, column) for column in flat.T]
    return np.stack(columns, axis=1).reshape(len(f), *values.shape[1:])


def measured_response(
    setup: PlatformSetup, controller: PlatformController, sines: MultisineSpec, seed: int | None
) -> MatrixResponse:
    """Play all realizations about home, `sines` in metres at the joints, and take the response of their second periods.
    Raises InputError where a motion is beyond the platform or trips."""
    period = setup.platform.period
    rows = round(sines.seconds / period)
    order = harmonics(sines.band, sines.seconds, period, sines.lines)
    responses = []
    for realization in range(REALIZATIONS):
        waves = sines.amplitude * orthogonal_sines(order, rows, realization)
        answers = [
            _answer(setup, controller, wave, None if seed is None else (seed, _FIRST + LEGS * realization + i))
            for i, wave in enumerate(waves)
        ]
        responses.append(matrix_response(waves, np.array(answers), order))
    return averaged(order / sines.seconds, np.array(responses))


def orthogonal_sines(order: np.ndarray, rows: int, realization: int) -> np.ndarray:
    """One period of six experiments [6, rows, 6] with harmonics [k], each axis of an experiment with all of them; the
    largest value is 1."""
    random = np.random.default_rng((_PHASES, realization)).uniform(0, 2 * np.pi, (LEGS, len(order)))
    sixths = 2 * np.pi * np.outer(np.arange(LEGS), np.arange(LEGS)) / LEGS
    lines = np.zeros((LEGS, LEGS, rows // 2 + 1), complex)
    lines[..., order] = np.exp(1j * (random + sixths[..., None])) / order
    waves = np.fft.irfft(lines, rows)
    return np.swapaxes(waves / np.abs(waves).max(), 1, 2)


def matrix_response(asked: np.ndarray, answered: np.ndarray, order: np.ndarray) -> np.ndarray:
    """[k, 6, 6] of whole periods [6, rows, 6] of what was asked for and answered, at harmonics [k]."""
    u, y = (np.moveaxis(np.fft.rfft(each, axis=1)[:, order], 0, -1) for each in (asked, answered))
    return y @ np.linalg.inv(u)


def averaged(f: np.ndarray, responses: np.ndarray) -> MatrixResponse:
    """The mean of realizations [n, k, 6, 6], with the deviation that their scatter gives it, averaged over lines."""
    count = len(responses)
    variance = np.abs(responses - responses.mean(axis=0)) ** 2
    variance = variance.sum(axis=0) / (count * (count - 1))
    around = np.clip(np.arange(len(f))[:, None] + np.arange(_POOLED) - _POOLED // 2, 0, len(f) - 1)
    return MatrixResponse(f, responses.mean(axis=0), np.sqrt(variance[around].mean(axis=1)))


def measured_pose(
    setup: PlatformSetup, controller: PlatformController, run: PlatformRun, seed: int | None
) -> np.ndarray:
    """The pose [k, 6] that the sensors of the legs tell, as the loop read them; the true one without a seed."""
    if seed is None:
        return run.pose
    sensors = LegSensors.of(setup, controller.measures, True)
    outputs = np.column_stack([run.signals[name] for name in setup.engine.plant.outputs])
    readings = sensors.read(outputs, sensors.draws(len(run.t), seed)[1:])
    return setup.platform.poses(readings[..., sensors.picked(("position",))[0]])


def _answer(
    setup: PlatformSetup, controller: PlatformController, wave: np.ndarray, seed: tuple[int, int] | None
) -> np.ndarray:
    """The second period [rows, 6], m at the joints, of the answer to a wave [rows, 6] that begins at rest."""
    weights, period = setup.platform.geometry.weights, setup.platform.period
    rise = np.clip(np.arange(len(wave)) * period / REST, 0.0, 1.0)[:, None]
    pose = np.vstack((wave * rise**2 * (3 - 2 * rise), wave)) / weights
    number = None if seed is None else int(np.random.SeedSequence(seed).generate_state(1)[0])
    try:
        check_motion(setup, pose)
    except InputError as error:
        raise InputError(f"[measure] amplitude: {str(error).removeprefix('record: ')}") from None
    run = run_platform(setup, controller, pose, number)
    if run.tripped is not None:
        raise InputError(f"[measure] amplitude: {run.tripped}; make it smaller")
    return measured_pose(setup, controller, run, number)[len(wave) :] * weights
