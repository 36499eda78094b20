"""One lane in plain numbers: for a single jack, what arrays of one element cost is most of a step."""

from math import isfinite
from typing import NamedTuple

import numpy as np

from .core import Core
from .task import Task


class FastStep(NamedTuple):
    """What a step in which nothing ended gave: the observation [channels], the rest as in Stepped."""

    observation: np.ndarray
    reward: float
    error: float
    command: float


class SingleLaneCore(Core):
    """A core of one lane. Steps in which nothing ends can be had as plain numbers, bit for bit those of `step`."""

    def __init__(self, task: Task) -> None:
        super().__init__(task, 1)
        self._u = np.empty_like(self.u[0])
        self._scalar_weights = tuple(weight.item() for weight in self._weights)

    def fast_step(self, demanded: float) -> FastStep | None:
        """One step with a demanded command, or None, with nothing changed, if something ends in it: then ask `step`.

        It is None, too, at every step of a rig whose commands come late.
        """
        guard, periods = self._guard, len(self._countdown)
        if self._late_drives or self._some_wait or guard.any_tripped or self._left <= periods or not isfinite(demanded):
            return None
        tracking, effort, rate = self._scalar_weights
        x, u, p, half_stroke, reward = self.x[0], self._u, self.p[0], self._half_stroke.item(), 0.0
        u[:] = self.u[0]
        command, before, now = guard.command.item(), guard.before.item(), self._now.item()
        last = now + periods
        while True:
            now += 1
            change = guard.change_of(demanded, command)
            u[0] = command = command + change
            reached = self._physics.advance_observe_one(x, u, p, self._period)
            if reached is None:
                return None
            x, outputs = reached
            if not abs(x.item(self._position)) < half_stroke:
                return None
            if self._moves:
                u[self._end_inputs[0]], u[self._end_inputs[1]] = self._end[:, now]
                outputs = self._physics.observe_one(x, u, p)
            measured = self._sensors.read(outputs, self._noise, now)
            signals = measured.tolist()
            if not guard.passes(signals, before):
                return None
            before = signals[guard.position]
            reference = self._reference.item(now)
            error = reference - outputs.item(self._controlled)
            reward -= abs(error) * tracking
            reward -= command * command * effort
            reward -= change * change * rate
            if now == last:
                break
        if not isfinite(reward):
            return None
        self.x, self.u[0] = x[None], u
        guard.command[0], guard.before[0], self._now[0] = command, before, now
        self._left -= periods
        observation = self._encoder.encode_one(
            (reference, reference - signals[self._controlled_sensor], command), x, measured
        )
        return FastStep(observation, reward, error, command)
