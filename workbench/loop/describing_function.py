"""Closed-loop frequency response by stepped sine: the nonlinear loop at a stated amplitude of the reference."""

from collections.abc import Callable, Sequence

import numpy as np

from ..control.protocol import Controller
from ..engine import Engine
from ..linear import Equilibrium
from ..linear.frequency_response import AGREE, SteppedSine, first_harmonic
from ..plant.valve import VALVES
from ..rigs.rig import Rig
from .sampled_loop import SampledLoop

_BLOCK = 0.2  # s: blocks of whole cycles last at least this, so that slow loop modes are seen to have settled
_LONGEST = 6.0  # s: a point that has not settled by then (or in two blocks) is flagged


def sampled_frequencies(low: float, high: float, count: int, period: float) -> np.ndarray:
    """About `count` frequencies [Hz] from low to high whose cycles are whole numbers of samples."""
    samples = np.unique(np.round(1 / (np.geomspace(low, high, count) * period)).astype(int))[::-1]
    return 1 / (samples * period)


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
    points = [_point(engine, rig, make(), start, float(f), amplitude) for f in frequencies]
    response, cycles, settled, saturated, cavitated = (np.array(column) for column in zip(*points, strict=True))
    name = make().measures[0]
    return SteppedSine(np.asarray(frequencies), amplitude, {name: response}, cycles, settled, saturated, cavitated)


def _point(
    engine: Engine, rig: Rig, controller: Controller, start: Equilibrium, f: float, amplitude: float
) -> tuple[complex, int, bool, bool, bool]:
    """Response, cycles run, settled, saturated, cavitated: whole cycles in blocks, until two blocks end alike."""
    k = round(1 / (f * rig.period.value))
    block = int(np.ceil(_BLOCK * f)) + 1
    name = controller.measures[0]
    level = engine.observe(start.x, start.u)[engine.plant.output(name)]
    reference = level + amplitude * np.sin(2 * np.pi * np.arange(k * block) / k)
    loop = SampledLoop(engine, rig, controller, start)
    before, cycles = None, 0
    while True:
        run = loop.run(reference)
        if run.tripped:
            return complex(np.nan, np.nan), cycles, False, True, False
        cycles += block
        signals = run.record.signals
        now = complex(first_harmonic(signals[name][-k - 1 :]) / first_harmonic(reference[-k - 1 :]))
        settled = before is not None and abs(now - before) < AGREE * abs(now)
        if settled or (before is not None and cycles / f > _LONGEST):
            altered = not np.allclose(run.demanded[-k:], signals["command"][-k:], atol=1e-9)
            limits = VALVES[rig.valve].saturation_limits(rig)
            full = any(np.abs(signals[signal][-k:]).max() > 0.999 * limit for signal, limit in limits.items())
            return now, cycles, settled, bool(altered or full), bool(signals["lowest_pressure"][-k:].min() < 0)
        before = now
