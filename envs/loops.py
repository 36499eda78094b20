"""N loops of the workbench side by side, compiled, which go on by a step of an environment at a time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.control.law import static_law
from workbench.engine import Engine, LaneDelays
from workbench.engine.guard_shape import length
from workbench.engine.sampled_law import OUT
from workbench.loop.compiled_loop import compiled_law
from workbench.loop.sensors import Sensors

from .task import Task

_PLACES = ("x", "u", "p", "law", "numbers", "rows", "t")


class LaneLoops:
    """Loops of a task's rig, their law demanding nothing: what is `added` to it is what the drives are asked for.

    All in fixed places. States x [N, n], inputs u [N, m] and parameters p [N, k] of the plants now; `command` [N] sent
    last, `trip` [N] the number in TRIPS or 0. To come, periods j of a step: references `wanted` [N, j], inputs but for
    the command `others` [N, j, m - 1], standard normal numbers `normal` [N, j, sensors]. `extremes` [.., k]: parameters
    of plants whose delays are as long as any. A copy has places of its own.
    """

    def __init__(self, task: Task, engine: Engine, sensors: Sensors, extremes: np.ndarray, lanes: int) -> None:
        self._made_of, periods = (task, engine, sensors, extremes, lanes), task.control_periods
        self._none = static_law([0.0, 0.0], (task.loop,), task.rig.period.value)
        self._law = law = compiled_law(engine, task.rig, [self._none], sensors, extremes, (task.loop,))
        shape, inputs = law.shape, law.shape.inputs(engine.plant)
        own = [0] * (lanes if shape.own_delays else 1)
        durations = law.durations[own] if law.durations.ndim > 1 else law.durations
        state, rows = np.zeros((lanes, length(shape.state))), np.zeros((lanes, periods, length(inputs)))
        numbers = law.numbers([self._none], np.zeros(1))[own]
        self._steps = steps = engine.sampled_steps(shape, durations, state, rows, numbers)
        self.x, self.u, self.p = steps.x, steps.u, steps.p
        self.command, self.trip = (state[:, place] for place in (shape.state["command"].start, shape.trip))
        self.wanted, self._added = rows[:, :, 0], rows[:, :, inputs["added"].start]
        self.others, self.normal = rows[:, :, inputs["others"]], rows[:, :, inputs["noise"]]
        self._held, self.sent, self.controlled = state[:, 0], steps.out[:, :, 0], steps.out[:, :, len(OUT)]

    def __reduce__(self) -> tuple[object, ...]:
        return LaneLoops, self._made_of, [getattr(self._steps, name) for name in _PLACES]

    def __setstate__(self, places: Sequence[np.ndarray]) -> None:
        for name, values in zip(_PLACES, places, strict=True):
            getattr(self._steps, name)[:] = values

    def begin(self, lanes: np.ndarray) -> None:
        """Some lanes begin anew, with their x, u and p: the drives have held u for ever."""
        steps, law = self._steps, self._law
        steps.law[lanes] = law.start(np.zeros((len(lanes), 0)), self.u[lanes, :1])
        self.others[lanes] = self.u[lanes, None, 1:]
        if law.shape.own_delays:
            plant, period = self._made_of[1].plant, self._made_of[0].rig.period.value
            delays = LaneDelays.of(plant.lane_lateness(self.p), period)
            steps.numbers[:] = replace(law, delays=delays).numbers([self._none], np.zeros(1))
            steps.t[:] = np.tile(delays.durations(period), len(steps.rows[0])) if steps.t.ndim > 1 else steps.t

    def advance(self, added: np.ndarray) -> np.ndarray:
        """A step with commands [N]; which lanes failed, bool [N]. Of its periods, commands `sent` [N, j] and the true
        signal `controlled` [N, j] at the beginning of each are there then, as far as a lane has come."""
        self._added[:] = added[:, None]
        return self._steps.advance()

    def observe(self) -> np.ndarray:
        """Outputs [N, h] now, in an array that the next call fills anew."""
        self.u[:, 0] = self._held
        return self._steps.observe()
