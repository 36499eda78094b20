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
class CompiledLaw:
    """A law with its guard, drive and sensors, ready to run on a plant: what decides the machine code, and numbers.

    durations [1 or 2]: of the intervals of a period, [s], where a command arrives inside it.
    """

    shape: LawShape
    durations: np.ndarray
    law: LinearLaw
    guard: Guard
    part: float
    noise: np.ndarray
    resolution: np.ndarray

    def numbers(self, offset: np.ndarray | float) -> np.ndarray:
        """The parameters [1 or lanes, k] of a law with this constant o, a number or [lanes, 1]."""
        law, more = self.law, self.shape.states - self.law.states
        return np.atleast_2d(
            packed(
                self.shape.numbers,
                a=np.pad(law.a, (0, more)).ravel(),
                b=np.pad(law.b, ((0, more), (0, 0))).ravel(),
                c=np.pad(law.c, (0, more)),
                d=law.d,
                e=np.pad(law.e, (0, more)),
                offset=offset,
                **self.guard.numbers(),
                part=self.part,
                noise=self.noise,
                resolution=self.resolution,
            )
        )

    def start(self, x: np.ndarray, command: np.ndarray) -> np.ndarray:
        """The state [lanes, k] at the start: of the law x [lanes, n], the drive holding a command [lanes, 1]."""
        lanes = len(x)
        return packed(
            self.shape.state,
            held=command,
            line=np.repeat(command, self.shape.late + 1, axis=1),
            command=command,
            position=np.full((lanes, 1), np.nan),
            trip=np.zeros((lanes, 1)),
            law=np.pad(x, ((0, 0), (0, self.shape.states - x.shape[1]))),
        ).copy()


def compiled_law(
    engine: Engine, rig: Rig, law: LinearLaw, sensors: Sensors, recorded: tuple[str, ...] = ()
) -> CompiledLaw:
    """A law on a rig's plant, with the rig's limits and sensors; `recorded` outputs are put out at each instant."""
    plant = engine.plant
    late, part = periods(plant.lateness(), rig.period.value)
    split, states = bool(part) and not plant.interpolated, -(-law.states // _STATES) * _STATES
    shape = LawShape(states, law.measures, sensors.names, late, split, plant.interpolated, sensors.noisy, recorded)
    places = [sensors.names.index(name) for name in shape.read]
    durations = np.array([part, 1 - part] if split else [1.0]) * rig.period.value
    return CompiledLaw(shape, durations, law, Guard(rig), part, sensors.noise[places], sensors.resolution[places])


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
    """One loop; each `run` goes on where the last ended.

    signals: (r, y) as measured at the start, where the drive holds the inputs u [m].
    """

    def __init__(
        self, engine: Engine, rig: Rig, law: LinearLaw, sensors: Sensors, u: np.ndarray, signals: np.ndarray
    ) -> None:
        self._engine, self._sensors = engine, sensors
        self._law = compiled_law(engine, rig, law, sensors)
        x, offset = law.start(signals, float(u[0]))
        self._numbers, self._state = self._law.numbers(offset), self._law.start(x[None], u[None, :1])

    def run(self, x: np.ndarray, reference: np.ndarray, added: np.ndarray, others: np.ndarray) -> Instants:
        """From the state x [n], along a reference [k], a command that is added to the law's, added [k], and the plant's
        inputs but for the command, others [k, m - 1]."""
        law = self._law
        rows = np.column_stack((reference, added, others, self._sensors.noise_rows(len(reference))))[None]
        batch, out = self._engine.run_sampled(law.shape, x[None], law.durations, self._state, rows, self._numbers)
        failed = int(batch.failed[0])
        sent, demanded, held, trips = out[0].T
        trip = TRIPS[int(trips[failed])]  # the last where nothing failed: -1
        reason = law.guard.reason(trip) if trip else None
        return Instants(batch.x[0], sent, demanded, held, reason, None if failed < 0 else failed)
