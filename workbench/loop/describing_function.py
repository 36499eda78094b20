"""Closed-loop frequency response by stepped sine: the nonlinear loop at a stated amplitude of the reference."""

from collections.abc import Callable, Sequence

import numpy as np

from ..base.gain_phase import gain_db
from ..control.protocol import Controller
from ..engine import Engine
from ..linear import Equilibrium
from ..linear.frequency_response import FLAGS, SteppedSine, merge
from ..rigs.rig import Rig
from .sampled_loop import SampledLoop
from .sine_points import SinePoint, run_points

_LIGHT, _WIDTHS = 0.3, (-2.0, -0.5, 0.0, 0.5, 2.0)  # damping of a mode that a sweep may pass by; points beside it
_STEEP, _ROUNDS = 3.0, 2  # dB between neighbours, above which there is a point between them


def sampled_frequencies(low: float, high: float, count: int, period: float) -> np.ndarray:
    """About `count` frequencies [Hz] from low to high whose cycles are whole numbers of samples."""
    samples = np.unique(np.round(1 / (np.geomspace(low, high, count) * period)).astype(int))[::-1]
    return 1 / (samples * period)


def sweep_frequencies(low: float, high: float, count: int, period: float, poles: np.ndarray) -> np.ndarray:
    """`sampled_frequencies`, and those at which a loop with these poles z resonates, with points beside each.

    An even sweep passes a lightly damped mode by: its peak is as wide as twice its damping.
    """
    turning = np.log(poles[np.imag(poles) > 0].astype(complex)) / (2 * np.pi * period)
    size, damping = np.abs(turning), -np.real(turning) / np.abs(turning)
    light = damping < _LIGHT
    near = (size[light, None] * (1 + np.outer(damping[light], _WIDTHS))).ravel()
    near = near[(near >= low) & (near <= high)]
    return np.union1d(sampled_frequencies(low, high, count, period), 1 / (np.round(1 / (near * period)) * period))


def closed_loop_sweep(
    engine: Engine,
    rig: Rig,
    make: Callable[[], Controller],
    start: Equilibrium,
    frequencies: Sequence[float] | np.ndarray,
    amplitude: float,
) -> SteppedSine:
    """`closed_loop_sine`, then the points between any two whose gains are more than 3 dB apart, twice at most."""
    sweep = closed_loop_sine(engine, rig, make, start, frequencies, amplitude)
    name = make().measures[0]
    for _ in range(_ROUNDS):
        level = gain_db(sweep.response[name])
        steep = np.flatnonzero(np.abs(np.diff(level)) > _STEEP)  # a trip is NaN, and no step
        samples = np.round(1 / (sweep.f * rig.period.value)).astype(int)
        between = np.setdiff1d((samples[steep] + samples[steep + 1]) // 2, samples)
        if not between.size:
            break
        more = closed_loop_sine(engine, rig, make, start, 1 / (between[::-1] * rig.period.value), amplitude)
        sweep = merge(sweep, more)
    return sweep


def closed_loop_sine(
    engine: Engine,
    rig: Rig,
    make: Callable[[], Controller],
    start: Equilibrium,
    frequencies: Sequence[float] | np.ndarray,
    amplitude: float,
) -> SteppedSine:
    """Response reference -> controlled signal to amplitude sin (unit of the signal) about an operating point.

    A point is flagged saturated where the guard altered the command or the current reached the drive's limit; where the
    loop trips it is NaN and not settled.
    """
    points = played_sines(engine, rig, make, start, [(float(f), amplitude) for f in frequencies])
    name = make().measures[0]
    flags = {key: np.array([getattr(point, key) for point in points]) for key in FLAGS}
    response = np.array([point.response for point in points], complex)
    return SteppedSine(np.asarray(frequencies), amplitude, {name: response}, **flags)


def played_sines(
    engine: Engine,
    rig: Rig,
    make: Callable[[], Controller],
    start: Equilibrium,
    sines: Sequence[tuple[float, float]],
) -> list[SinePoint]:
    """Sines of the reference, frequency [Hz] and amplitude (unit of the signal) each, played until they settle."""
    controller = make()
    name = controller.measures[0]
    level = float(engine.observe(start.x, start.u)[engine.plant.output(name)])
    points = [SinePoint(rig, name, f, level, amplitude) for f, amplitude in sines]
    if compiled := SampledLoop(engine, rig, controller, start).compiled:
        run_points(engine, compiled, start, points)
    else:
        for point in points:
            _run_in_python(SampledLoop(engine, rig, make(), start), point)
    return points


def _run_in_python(loop: SampledLoop, point: SinePoint) -> None:
    """Block after block."""
    while not point.done:
        run = loop.run(point.reference)
        if run.tripped:
            point.trip()
        else:
            point.end_block(run.record.signals, run.record.signals["command"], run.demanded)
