"""Closed-loop frequency response by stepped sine: the nonlinear loop at a stated amplitude of the reference.

Points are judged by the last cycle of a block; those of compiled loops run in lanes.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..base.gain_phase import gain_db
from ..control.protocol import Controller
from ..engine import Engine
from ..engine.sampled_law import OUT
from ..linear import Equilibrium
from ..linear.frequency_response import AGREE, FLAGS, SteppedSine, first_harmonic, merge
from ..plant.valve import VALVES
from ..rigs.oil import CAVITATES
from ..rigs.rig import Rig
from .compiled_loop import CompiledLoop
from .sampled_loop import SampledLoop

_BLOCK = 0.2  # s: blocks of whole cycles last at least this, so that slow loop modes are seen to have settled
_LONGEST = 6.0  # s: a point that has not settled by then (or in two blocks) is flagged
_ROUND = 250  # instants: lanes run so far at least before the ends of their blocks are looked at
_LIGHT, _WIDTHS = 0.3, (-2.0, -0.5, 0.0, 0.5, 2.0)  # damping of a mode that a sweep may pass by; points beside it
_STEEP, _ROUNDS = 3.0, 2  # dB between neighbours, above which there is a point between them


class SinePoint:
    """A frequency [Hz] whose cycle is whole samples: cycles in blocks, until two blocks end alike.

    reference [k] of a block, SI. response is NaN where the loop tripped, None until the point is `done`.
    """

    def __init__(self, rig: Rig, signal: str, f: float, level: float, amplitude: float) -> None:
        self._f, self._signal, self._limits = f, signal, _limits(rig)
        self._chambers = ("lowest_pressure",) if rig.is_jack else ()
        self._cycle, self._block = round(1 / (f * rig.period.value)), int(np.ceil(_BLOCK * f)) + 1
        turn = 2 * np.pi * np.arange(self._cycle * self._block) / self._cycle
        self.reference = level + amplitude * np.sin(turn)
        self._before, self.response = None, None
        self.cycles, self.done, self.settled, self.saturated, self.cavitated = 0, False, False, False, False

    @property
    def signals(self) -> tuple[str, ...]:
        """The outputs that `end_block` looks at."""
        return self._signal, *self._chambers, *self._limits

    def trip(self) -> None:
        """The loop tripped, or its simulation failed."""
        self.response, self.saturated, self.done = complex(np.nan, np.nan), True, True

    def end_block(self, signals: Mapping[str, np.ndarray], command: np.ndarray, demanded: np.ndarray) -> None:
        """A block is over: its outputs, the realised and the demanded commands, [k] each."""
        k = self._cycle
        self.cycles += self._block
        y, asked = (values[-k - 1 :] for values in (signals[self._signal], self.reference))
        before, self.response = self._before, complex(first_harmonic(y) / first_harmonic(asked))
        self._before = self.response
        if before is None:
            return
        self.settled = abs(self.response - before) < AGREE * abs(self.response)
        self.done = self.settled or self.cycles / self._f > _LONGEST
        altered = not np.allclose(demanded[-k:], command[-k:], atol=1e-9)
        full = any(np.abs(signals[name][-k:]).max() > 0.999 * limit for name, limit in self._limits.items())
        self.saturated = bool(altered or full)
        self.cavitated = any(bool(signals[name][-k:].min() < CAVITATES) for name in self._chambers)


def _limits(rig: Rig) -> Mapping[str, float]:
    """Outputs that are saturated at a number, SI."""
    return VALVES[rig.valve].saturation_limits(rig) if rig.is_jack else {}


def run_points(engine: Engine, loop: CompiledLoop, start: Equilibrium, points: Sequence[SinePoint]) -> None:
    """Every point to its end, each a lane of one compiled loop that stands at its start."""
    lanes = [_Lane(engine, loop, start, point) for point in points]
    while lanes:
        steps = max(_ROUND, min(lane.left for lane in lanes))
        references = np.stack([lane.reference(steps) for lane in lanes])
        others = np.broadcast_to(start.u[1:], (len(lanes), steps, len(start.u) - 1))
        given = np.stack((references, np.zeros_like(references)), axis=2)
        state = np.stack([lane.state for lane in lanes])
        batch, out = engine.run_sampled(
            loop.law.shape,
            np.stack([lane.x for lane in lanes]),
            loop.law.durations,
            state,
            np.concatenate((given, others), axis=2),
            loop.numbers,
        )
        held = out[:, :, [OUT.index("held")]]
        outputs = engine.outputs(batch.x[:, :-1], np.concatenate((held, others), axis=2))
        for i, lane in enumerate(lanes):
            lane.go_on(batch.x[i, -1], state[i], outputs[i], out[i])
        lanes = [lane for lane in lanes if not lane.point.done]


class _Lane:
    """A point on its way: where plant and law are, and what they did since the last block's end."""

    def __init__(self, engine: Engine, loop: CompiledLoop, start: Equilibrium, point: SinePoint) -> None:
        self.point, self.x, self.state = point, start.x, loop.state[0]
        self._columns = [engine.plant.output(name) for name in point.signals]
        self._rows = np.empty((0, len(OUT) + len(self._columns)))

    @property
    def left(self) -> int:
        """Samples to the end of the block."""
        return len(self.point.reference) - len(self._rows)

    def reference(self, steps: int) -> np.ndarray:
        """The next samples [steps] of the reference, which goes round block by block."""
        whole = self.point.reference
        return whole[(len(self._rows) + np.arange(steps)) % len(whole)]

    def go_on(self, x: np.ndarray, state: np.ndarray, outputs: np.ndarray, out: np.ndarray) -> None:
        """It ran up to the state x [n]: outputs [steps, ..] and what the instants put out [steps, ..]."""
        self.x, self.state = x, state
        self._rows = np.vstack((self._rows, np.hstack((out, outputs[:, self._columns]))))
        size = len(self.point.reference)
        while not self.point.done and len(self._rows) >= size and self._stands(size):
            block, self._rows = (
                dict(zip((*OUT, *self.point.signals), self._rows[:size].T, strict=True)),
                self._rows[size:],
            )
            self.point.end_block(block, block["sent"], block["demanded"])
        if not self.point.done and not self._stands(size):
            self.point.trip()

    def _stands(self, size: int) -> bool:
        """Whether nothing tripped or failed in this block, as far as it is run."""
        return bool(np.all(self._rows[:size, OUT.index("trip")] == 0))


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
