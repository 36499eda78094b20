"""Points of a stepped sine of a closed loop: what the last cycle of a block says, and compiled loops in lanes."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..engine import Engine
from ..engine.sampled_law import OUT
from ..linear import Equilibrium
from ..linear.frequency_response import AGREE, first_harmonic
from ..plant.valve import VALVES
from ..rigs.rig import Rig
from .compiled_loop import CompiledLoop

_BLOCK = 0.2  # s: blocks of whole cycles last at least this, so that slow loop modes are seen to have settled
_LONGEST = 6.0  # s: a point that has not settled by then (or in two blocks) is flagged
_ROUND = 250  # instants: lanes run so far at least before the ends of their blocks are looked at


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
        self.cavitated = any(bool(signals[name][-k:].min() < 0) for name in self._chambers)


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
