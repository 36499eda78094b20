"""Frequency response: of a linear model, and by stepped sine on the nonlinear plant at a stated amplitude.

Stepped sine: the input is a sine held over short intervals; once two successive cycles agree, the first Fourier
coefficient of each output over that of the held input is the response (the describing function of the whole plant).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import control
import numpy as np

from .engine import Engine
from .errors import InputError

POINTS_PER_CYCLE = 64
_LONGEST_HOLD = 0.25e-3  # s: a coarser staircase would itself excite the valve
AGREE = 2e-3  # settled when successive cycles differ by less than this part of the response
_CYCLES = (4, 60)


@dataclass(frozen=True)
class SteppedSine:
    """Response of each output at frequencies f [k] in Hz, complex [k], with what happened at each point [k]."""

    f: np.ndarray
    amplitude: float
    response: Mapping[str, np.ndarray]
    cycles: np.ndarray
    settled: np.ndarray
    saturated: np.ndarray
    cavitated: np.ndarray


@dataclass(frozen=True)
class _Point:
    response: dict[str, complex]
    cycles: int
    settled: bool
    saturated: bool
    cavitated: bool


def first_harmonic(samples: np.ndarray) -> np.ndarray:
    """Complex first harmonic of one cycle of equally spaced samples [k + 1, ...], both ends given, drift removed.

    A jack integrates: the straight line from the first to the last sample is taken off first.
    """
    k = len(samples) - 1
    ramp = np.arange(k).reshape(-1, *([1] * (samples.ndim - 1))) / k
    level = samples[:-1] - ramp * (samples[-1] - samples[0])
    turn = np.exp(-2j * np.pi * np.arange(k) / k)
    return 2 / k * np.tensordot(turn, level, axes=(0, 0))


def held_harmonic(amplitude: float, points: int) -> complex:
    """First harmonic of amplitude sin(w t) held over `points` equal intervals a cycle: less gain, half a hold late."""
    lag = np.pi / points
    return -1j * amplitude * np.sin(lag) / lag * np.exp(-1j * lag)


def stepped_sine(
    engine: Engine,
    start: np.ndarray,
    offset: np.ndarray,
    frequencies: Sequence[float] | np.ndarray,
    amplitude: float,
    outputs: Sequence[str],
    limits: Mapping[str, float] | None = None,
) -> SteppedSine:
    """Response of `outputs` to the plant's first input, `offset` [m] + amplitude sin, from state `start` [n].

    `limits` gives the output levels at which a point counts as saturated, e.g. {"current": 0.02}. Each point starts
    from `start` and runs until it has settled or 60 cycles are over (`settled` tells). Raises InputError if a run
    fails.
    """
    points = [_point(engine, start, offset, float(f), amplitude, outputs, limits or {}) for f in frequencies]
    return SteppedSine(
        f=np.asarray(frequencies, dtype=float),
        amplitude=amplitude,
        response={name: np.array([point.response[name] for point in points]) for name in outputs},
        cycles=np.array([point.cycles for point in points]),
        settled=np.array([point.settled for point in points]),
        saturated=np.array([point.saturated for point in points]),
        cavitated=np.array([point.cavitated for point in points]),
    )


def _point(
    engine: Engine,
    start: np.ndarray,
    offset: np.ndarray,
    f: float,
    amplitude: float,
    outputs: Sequence[str],
    limits: Mapping[str, float],
) -> _Point:
    plant = engine.plant
    k = max(POINTS_PER_CYCLE, int(np.ceil(1 / f / _LONGEST_HOLD)))
    t = np.arange(k + 1) / (f * k)
    u = np.tile(offset, (k + 1, 1))
    u[:, 0] += amplitude * np.sin(2 * np.pi * f * t)
    columns = [plant.output(name) for name in outputs]
    forced = held_harmonic(amplitude, k)
    before, x, settled, cycle = None, start, False, 0
    seen = np.zeros((k + 1, len(plant.outputs)))
    while not settled and cycle < _CYCLES[1]:
        run = engine.run(x, t, u)
        if not run.ok:
            raise InputError(
                f"{plant.name}: the simulation failed at {f:g} Hz, amplitude {amplitude:g}; try a smaller one"
            )
        x, cycle = run.x[-1], cycle + 1
        seen = engine.outputs(run.x, u)
        now = first_harmonic(seen[:, columns]) / forced
        settled = (
            before is not None and cycle >= _CYCLES[0] and bool(np.all(np.abs(now - before) < AGREE * np.abs(now)))
        )
        before = now
    assert before is not None
    return _Point(
        response=dict(zip(outputs, before, strict=True)),
        cycles=cycle,
        settled=settled,
        saturated=any(np.abs(seen[:, plant.output(name)]).max() >= 0.999 * level for name, level in limits.items()),
        cavitated=bool(seen[:, plant.output("lowest_pressure")].min() < 0),
    )


def decibels(response: np.ndarray) -> np.ndarray:
    """Gain [dB]."""
    return 20 * np.log10(np.abs(response))


def degrees(response: np.ndarray) -> np.ndarray:
    """Phase [deg], without jumps along the last axis."""
    return np.degrees(np.unwrap(np.angle(response)))


def crossing(f: np.ndarray, value: np.ndarray, level: float) -> float | None:
    """First frequency at which `value` falls through `level`, by interpolation over log f; None if it never does."""
    below = np.flatnonzero((value[1:] < level) & (value[:-1] >= level))
    if not len(below):
        return None
    i = below[0]
    part = (value[i] - level) / (value[i] - value[i + 1])
    return float(np.exp(np.log(f[i]) + part * np.log(f[i + 1] / f[i])))


def scan(
    engine: Engine,
    start: np.ndarray,
    offset: np.ndarray,
    frequencies: np.ndarray,
    amplitude: float,
    output: str,
    limits: Mapping[str, float] | None = None,
) -> SteppedSine:
    """`stepped_sine` over `frequencies`, then three more points, twice, around the -3 dB and the -90 degree crossings.

    Gain is referred to the first frequency. A gain that runs flat near -3 dB can not be read off a coarse grid.
    """
    found = stepped_sine(engine, start, offset, frequencies, amplitude, [output], limits)
    for _ in range(2):
        response = found.response[output]
        corners = (decibels(response / np.abs(response[0])) + 3, degrees(response) + 90)
        more = np.unique(np.concatenate([_around_crossing(found.f, corner) for corner in corners]))
        if len(more):
            found = _merge(found, stepped_sine(engine, start, offset, more, amplitude, [output], limits))
    return found


def _around_crossing(f: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Three frequencies inside the first interval in which `value` falls through zero; none if it does not."""
    below = np.flatnonzero((value[1:] < 0) & (value[:-1] >= 0))
    return np.geomspace(f[below[0]], f[below[0] + 1], 5)[1:-1] if len(below) else np.array([])


def _merge(first: SteppedSine, second: SteppedSine) -> SteppedSine:
    order = np.argsort(np.concatenate([first.f, second.f]), kind="stable")

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(first, name), getattr(second, name)])[order]

    response = {name: np.concatenate([first.response[name], second.response[name]])[order] for name in first.response}
    flags = {name: joined(name) for name in ("cycles", "settled", "saturated", "cavitated")}
    return SteppedSine(joined("f"), first.amplitude, response, **flags)


def linear_response(system: control.StateSpace | control.TransferFunction, f: np.ndarray) -> np.ndarray:
    """Response of a single-input, single-output python-control system at f [k] in Hz, complex [k]."""
    return np.asarray(system(2j * np.pi * f)).ravel()
