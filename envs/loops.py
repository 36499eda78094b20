"""N loops of the workbench side by side, compiled, which go on by a step of an environment at a time."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from workbench.control.law import Law
from workbench.engine import Engine, LaneDelays
from workbench.engine.guard_shape import length
from workbench.engine.sampled_law import OUT
from workbench.loop.compiled_loop import CompiledLaw, compiled_law
from workbench.loop.sensors import Sensors
from workbench.rigs.rig import Rig

_PLACES = ("x", "u", "p", "law", "numbers", "rows", "t")


class LaneLoops:
    """Loops of a law with its guards, drives and sensors, `periods` (lanes, periods of a step): to the command of each
    is `added` what it is asked for. `made` gives the law and its numbers q [k] anew in every process.

    All in fixed places. States x [N, n], inputs u [N, m] and parameters p [N, k] of the plants now; `command` [N] sent
    last, `trip` [N] the number in TRIPS or 0. To come, periods j of a step: `rows` [N, j, k] by their `places`, of
    which references `wanted` [N, j], inputs but for the commands `others` [N, j, m - 1], standard normal numbers
    `normal` [N, j, sensors]. Of platforms `command`, `trip` and `sent` have a further axis [6]. A copy has places of
    its own. `own_offsets`: laws have constants of their own.
    """

    def __init__(
        self,
        made: Callable[[], tuple[CompiledLaw, np.ndarray]],
        engine: Engine,
        period: float,
        periods: tuple[int, int],
        own_offsets: bool = False,
    ) -> None:
        self._made_of, self.periods = (made, engine, period, periods, own_offsets), periods
        (law, self._q), lanes = made(), periods[0]
        self._law, shape, jacks = law, law.shape, law.shape.jacks
        self.places = inputs = shape.inputs(engine.plant)
        self._own = own_offsets or shape.own_delays
        self._offset = np.zeros((lanes if self._own else 1, jacks))
        durations, first = law.durations, np.zeros(len(self._offset), int)  # until lanes have their own
        durations = durations[[0] * lanes] if durations.ndim > 1 else durations
        state, rows = np.zeros((lanes, length(shape.state))), np.zeros((*periods, length(inputs)))
        numbers = law.parameters(self._q[None], self._offset[:1])[first]
        self._steps = steps = engine.sampled_steps(shape, durations, state, rows, numbers)
        self.x, self.u, self.p, self.rows = steps.x, steps.u, steps.p, rows
        guard = length(shape.guard.state)
        self.command, self.trip = (
            _jacks(state, shape.state["command"].start, jacks),
            _jacks(state, shape.trip, jacks, guard),
        )
        self.wanted, self._added = rows[:, :, 0], _jacks(rows, inputs["added"].start, jacks)
        self.others, self.normal = rows[:, :, inputs["others"]], rows[:, :, inputs["noise"]]
        self._held, self.sent = state[:, :jacks], _jacks(steps.out, 0, jacks)
        self.recorded = steps.out[:, :, jacks * len(OUT) :]

    def __reduce__(self) -> tuple[object, ...]:
        return LaneLoops, self._made_of, [self._offset, *(getattr(self._steps, name) for name in _PLACES)]

    def __setstate__(self, places: Sequence[np.ndarray]) -> None:
        offset, *own = places
        self._offset[:] = offset
        for name, values in zip(_PLACES, own, strict=True):
            getattr(self._steps, name)[:] = values
        self._steps.numbers[:, self._law.shape.numbers["q"]] = self._q  # they may have addresses of this process

    def begin(self, lanes: np.ndarray, states: np.ndarray | None = None, offset: float | np.ndarray = 0.0) -> None:
        """Some lanes begin anew, with their x, u and p: the drives have held u for ever, the laws have `states` [lanes,
        k] and constants `offset` [lanes, 1]."""
        steps, law, jacks = self._steps, self._law, self._held.shape[1]
        steps.law[lanes] = law.start(np.zeros((len(lanes), 0)) if states is None else states, self.u[lanes, :jacks])
        self.others[lanes] = self.u[lanes, None, jacks:]
        if self._own:
            self._offset[lanes] = offset
            steps.numbers[lanes, law.shape.numbers["offset"]] = offset
        if law.shape.own_delays:
            plant, period = self._made_of[1].plant, self._made_of[2]
            delays = LaneDelays.of(plant.lane_lateness(self.p), period)
            steps.numbers[:] = replace(law, delays=delays).parameters(self._q[None], self._offset)
            steps.t[:] = np.tile(delays.durations(period), len(steps.rows[0])) if steps.t.ndim > 1 else steps.t

    def advance(self, added: np.ndarray) -> np.ndarray:
        """A step with commands [N]; which lanes failed, bool [N]. Of its periods, commands `sent` [N, j] and the true
        outputs `recorded` [N, j, k] at the beginning of each are there then, as far as a lane has come."""
        self._added[:] = added[:, None]
        return self._steps.advance()

    def observe(self) -> np.ndarray:
        """Outputs [N, h] now, in an array that the next call fills anew."""
        self.u[:, : self._held.shape[1]] = self._held
        return self._steps.observe()


def of_jacks(
    engine: Engine, rig: Rig, law: Law, sensors: Sensors, p: np.ndarray, recorded: str
) -> tuple[CompiledLaw, np.ndarray]:
    """One law on jacks with parameters p [.., k], whose delays are as long as any, and its numbers; an output is
    recorded."""
    compiled = compiled_law(engine, rig, [law], sensors, p, (recorded,))
    return compiled, law.dense(compiled.states).numbers


def _jacks(places: np.ndarray, first: int, jacks: int, apart: int = 1) -> np.ndarray:
    """One number of a single jack [..], of several [.., jacks], so far apart."""
    return places[..., first] if jacks == 1 else places[..., first : first + jacks * apart : apart]
