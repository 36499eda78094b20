"""Frequency response: of a linear model, and by stepped sine on the nonlinear plant at a stated amplitude.

Stepped sine: the input is a sine held over short intervals; once two successive cycles agree, the first Fourier
coefficient of each output over that of the held input is the response (the describing function of the whole plant).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import InputError
from ..base.gain_phase import gain_db, phase_deg
from ..engine import Engine
from ..rigs.oil import CAVITATES
from .crossings import crossings

if TYPE_CHECKING:
    import control

POINTS_PER_CYCLE = 64
_LONGEST_HOLD = 0.25e-3  # s: a coarser staircase would itself excite the valve
AGREE = 2e-3  # settled when successive cycles differ by less than this part of the response
_CYCLES = (4, 60)
FLAGS = ("cycles", "settled", "saturated", "cavitated")  # of a SteppedSine's points


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
    p: np.ndarray | None = None,
) -> SteppedSine:
    """Response of a plant to sines on its first input, one frequency after another, from the nonlinear simulation.

    Each point runs until it has settled or 60 cycles are over (`settled` tells); all frequencies run at once. A delay
    of the plant's command counts, exactly.

    Parameters
    ----------
    engine
        The engine of the plant.
    start
        State [n] from which each point starts.
    offset
        Inputs [m] about which the first moves, SI.
    frequencies
        Frequencies [k] in Hz.
    amplitude
        Amplitude of the first input, SI.
    outputs
        Names of the signals whose response counts.
    limits
        Levels of outputs, SI, at which a point counts as saturated, such as {"current": 0.02}.
    p
        Parameters [k] other than the plant's.

    Returns
    -------
    Complex responses by output, and which points are settled and saturated.

    Raises
    ------
    InputError
        If a run fails.
    """
    f, p = np.asarray(frequencies, dtype=float), engine.plant.p if p is None else p
    starts, rows = (np.tile(row, (len(f), 1)) for row in (start, p))
    sine = stepped_sines(engine, starts, offset, f, amplitude, outputs, limits, rows)
    failed = np.any([np.isnan(response) for response in sine.response.values()], axis=0)
    if failed.any():
        raise InputError(
            f"{engine.plant.name}: the simulation failed at {f[failed][0]:g} Hz, amplitude {amplitude:g}; try a "
            "smaller one"
        )
    return sine


def stepped_sines(
    engine: Engine,
    start: np.ndarray,
    offset: np.ndarray,
    f: np.ndarray,
    amplitude: float,
    outputs: Sequence[str],
    limits: Mapping[str, float] | None,
    p: np.ndarray,
    span: tuple[int, int] = _CYCLES,
) -> SteppedSine:
    """`stepped_sine` of many plants: each point f [k] with its own start [k, n] and parameters [k, np].

    The response of a point whose run fails is NaN; one settles after so many cycles as `span`
    says, at least and at most; where it has not, it is left there.
    """
    sine = SteppedSine(
        f=f,
        amplitude=amplitude,
        response={name: np.zeros(len(f), complex) for name in outputs},
        cycles=np.zeros(len(f), int),
        settled=np.zeros(len(f), bool),
        saturated=np.zeros(len(f), bool),
        cavitated=np.zeros(len(f), bool),
    )
    points = _points_per_cycle(f)
    for k in np.unique(points):
        _run_lanes(engine, start, offset, sine, np.flatnonzero(points == k), int(k), limits or {}, p, span)
    late = engine.plant.lane_lateness(p)
    for values in sine.response.values():  # all that repeats comes late as a whole
        values *= np.exp(-2j * np.pi * f * late)
    return sine


def _points_per_cycle(f: np.ndarray) -> np.ndarray:
    """Held intervals per cycle: 64, doubled until none is longer than 0.25 ms."""
    doublings = np.ceil(np.log2(np.maximum(1 / (f * _LONGEST_HOLD * POINTS_PER_CYCLE), 1)))
    return POINTS_PER_CYCLE * 2 ** doublings.astype(int)


def _run_lanes(
    engine: Engine,
    start: np.ndarray,
    offset: np.ndarray,
    sine: SteppedSine,
    lanes: np.ndarray,
    k: int,
    limits: Mapping[str, float],
    p: np.ndarray,
    span: tuple[int, int],
) -> None:
    """Cycle after cycle for the points `lanes` of `sine`, which it fills in; settled and failed ones drop out."""
    plant, names = engine.plant, list(sine.response)
    t = np.arange(k + 1) / (sine.f[lanes, None] * k)
    u = np.tile(offset, (k + 1, 1))
    u[:, 0] += sine.amplitude * np.sin(2 * np.pi * np.arange(k + 1) / k)
    columns = [plant.output(name) for name in names]
    forced = held_harmonic(sine.amplitude, k)
    x, before = start[lanes], np.full((len(lanes), len(names)), np.nan, complex)
    least, most = span
    for cycle in range(1, most + 1):
        batch = engine.run_batch(x, t, u, p[lanes])
        outputs = engine.outputs(batch.x, u, p[lanes, None])
        now = first_harmonic(np.moveaxis(outputs[:, :, columns], 0, 1)) / forced
        now[~batch.ok] = np.nan
        settled = np.all(np.abs(now - before) < AGREE * np.abs(now), axis=1) & (cycle >= least)
        for name, values in zip(names, now.T, strict=True):
            sine.response[name][lanes] = values
        sine.cycles[lanes], sine.settled[lanes] = cycle, settled
        peaks = {name: np.abs(outputs[:, :, plant.output(name)]).max(axis=1) for name in limits}
        sine.saturated[lanes] = np.any([peaks[n] >= 0.999 * limits[n] for n in limits], axis=0) if limits else False
        sine.cavitated[lanes] = outputs[:, :, plant.output("lowest_pressure")].min(axis=1) < CAVITATES
        going = batch.ok & ~settled
        if not going.any():
            return
        lanes, t, x, before = lanes[going], t[going], batch.x[going, -1], now[going]


def scan(
    engine: Engine,
    start: np.ndarray,
    offset: np.ndarray,
    frequencies: np.ndarray,
    amplitude: float,
    output: str,
    limits: Mapping[str, float] | None = None,
    p: np.ndarray | None = None,
) -> SteppedSine:
    """`stepped_sine` over `frequencies`, then three more points, twice, around the -3 dB and the -90 degree crossings.

    Gain is referred to the first frequency. A gain that runs flat near -3 dB cannot be read off a coarse grid.
    """
    sine = stepped_sine(engine, start, offset, frequencies, amplitude, [output], limits, p)
    for _ in range(2):
        response = sine.response[output]
        corners = (gain_db(response / np.abs(response[0])) + 3, phase_deg(response) + 90)
        more = np.unique(np.concatenate([_around_crossing(sine.f, corner) for corner in corners]))
        if len(more):
            sine = merge(sine, stepped_sine(engine, start, offset, more, amplitude, [output], limits, p))
    return sine


def _around_crossing(f: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Three frequencies inside the first interval in which `value` falls through zero; none if it does not."""
    intervals = crossings(value, falling=True)[0]
    return np.geomspace(f[intervals[0]], f[intervals[0] + 1], 5)[1:-1] if len(intervals) else np.array([])


def merge(first: SteppedSine, second: SteppedSine) -> SteppedSine:
    """The points of both, in order of frequency; the amplitude is the first's."""
    order = np.argsort(np.concatenate([first.f, second.f]), kind="stable")

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(first, name), getattr(second, name)])[order]

    response = {name: np.concatenate([first.response[name], second.response[name]])[order] for name in first.response}
    flags = {name: joined(name) for name in FLAGS}
    return SteppedSine(joined("f"), first.amplitude, response, **flags)


def linear_response(system: "control.StateSpace | control.TransferFunction", f: np.ndarray) -> np.ndarray:
    """Response of a single-input, single-output python-control system at f [k] in Hz, complex [k]."""
    return np.asarray(system(2j * np.pi * f)).ravel()
