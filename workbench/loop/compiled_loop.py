"""Closed loops of a linear law, compiled: the plant, the law and the guard in one run of the engine."""

from dataclasses import dataclass

import numpy as np

from ..control.linear_law import LinearLaw
from ..engine import Engine, periods
from ..engine.sampled_law import TRIPS, LawShape, packed
from ..rigs.rig import Rig
from .guard import Guard
from .sensors import Sensors

_STATES = 4  # laws are filled up to a multiple of so many states, so that laws alike share their machine code


@dataclass(frozen=True)
class Instants:
    """What happened at k sampling instants: states of the plant x [k + 1, n]; commands sent, demanded and held [k].

    trip: why the guard tripped, or None. failed: the instant after which the simulation failed, or None.
    """

    x: np.ndarray
    sent: np.ndarray
    demanded: np.ndarray
    held: np.ndarray
    trip: str | None
    failed: int | None


class CompiledLoop:
    """A law with its guard, drive and sensors on a plant; each `run` goes on where the last ended.

    signals: (r, y) as measured at the start, where the drive holds the inputs u [m].
    """

    def __init__(
        self, engine: Engine, rig: Rig, law: LinearLaw, sensors: Sensors, u: np.ndarray, signals: np.ndarray
    ) -> None:
        plant, command = engine.plant, float(u[0])
        late, self._part = periods(plant.lateness(), rig.period.value)
        self._engine, self._rig, self._sensors = engine, rig, sensors
        split = bool(self._part) and not plant.interpolated
        states = -(-law.states // _STATES) * _STATES
        self.shape = LawShape(states, law.measures, sensors.names, late, split, plant.interpolated, sensors.noisy)
        self._durations = np.array([self._part, 1 - self._part] if split else [1.0]) * rig.period.value
        x, offset = law.start(signals, command)
        self._numbers = packed(
            self.shape.numbers, **law_numbers(law, self.shape, offset), **Guard(rig).numbers(), part=self._part,
            **self._sensor_numbers(),
        )[None]  # fmt: skip
        line = np.full(late + 1, command)
        filled = np.append(x, np.zeros(self.shape.states - law.states))
        self._state = packed(
            self.shape.state, held=command, line=line, command=command, position=np.nan, trip=0.0, law=filled
        )[None].copy()

    def _sensor_numbers(self) -> dict[str, np.ndarray]:
        places = [self._sensors.names.index(name) for name in self.shape.read]
        return {"noise": self._sensors.noise[places], "resolution": self._sensors.resolution[places]}

    def run(self, x: np.ndarray, reference: np.ndarray, others: np.ndarray) -> Instants:
        """From the state x [n], along a reference [k] and the plant's inputs but for the command, others [k, m - 1]."""
        rows = np.column_stack((reference, others, self._sensors.noise_rows(len(reference))))[None]
        batch, out = self._engine.run_sampled(self.shape, x[None], self._durations, self._state, rows, self._numbers)
        failed = int(batch.failed[0])
        sent, demanded, held, trip = out[0].T
        last = int(trip[failed if failed >= 0 else -1])
        return Instants(
            batch.x[0], sent, demanded, held, Guard(self._rig).reason(TRIPS[last]) if last else None,
            None if failed < 0 else failed,
        )  # fmt: skip


def law_numbers(law: LinearLaw, shape: LawShape, offset: float) -> dict[str, np.ndarray | float]:
    """A law as parameters, filled up with states that stay 0."""
    more = shape.states - law.states
    return {
        "a": np.pad(law.a, (0, more)),
        "b": np.pad(law.b, ((0, more), (0, 0))),
        "c": np.pad(law.c, (0, more)),
        "d": law.d,
        "e": np.pad(law.e, (0, more)),
        "offset": offset,
    }
