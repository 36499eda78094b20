"""A rig that is served: its plant, sensors, drives and limits, period by period."""

from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Protocol

import numpy as np

from ..engine import DelayLine
from ..engine.buffered import BufferedFunction
from ..engine.instant import watched_readings
from ..loop.sampled_loop import closing_parameters
from ..loop.sensors import draws
from ..rigs.limited import SignalLimit
from ..rigs.sampling import command_change
from . import datagrams
from .bench import Bench
from .datagrams import Reading

_ROWS = 256  # readings whose noise is drawn at once
_RUN_OUT = 1.0  # s that a rig in lockstep runs on after it was switched off
_FURTHER = 0.005  # of a limit, by which a rig that stands beyond it may go on
_SAME = 1e-12  # within which a command counts as not limited
OFF, ON, TRIPPED = range(3)
_STATUS = (0, datagrams.IS_ON, datagrams.IS_TRIPPED)


class Draws(Protocol):
    """The source of the noise of readings."""

    def standard_normal(self, size: tuple[int, int]) -> np.ndarray:
        """Numbers [rows, channels] of variance 1, which follow those drawn before."""
        ...


class ServedRig:
    """A bench in service: off, on or tripped. Noise is drawn from `seed`, anew at each "on"; by `noise`, a function of
    the seed and how often it was switched on, which is white unless another is given.

    `x` [n] is the plant's state, `demanded` and `command` [m] what is asked of its drives and what they were sent,
    `outputs` the true values at the last sample. `sequence`, `tick` and `flags` go into its reading; `limited` says
    whether the last command was.
    """

    def __init__(self, bench: Bench, seed: int, noise: Callable[[int, int], Draws] = draws) -> None:
        self.bench, self._seed, self._switched, self._draws = bench, seed, 0, noise
        self._engine = deepcopy(bench.engine)  # with places of its own for the thread that serves
        plant, channels = bench.plant, len(bench.channels)
        columns, watched = (
            [plant.output(name) for name in names]
            for names in (bench.channels, [limit.signal for limit in bench.limits])
        )
        self._sense = BufferedFunction(
            watched_readings(len(plant.outputs), columns, bench.resolution.tolist(), watched)
        )
        self.outputs, self._disturbed, self._middles, self._sizes = self._sense.given
        self._middles[:] = [limit.middle for limit in bench.limits]
        self._drives = [(c.low, c.high, step) for c, step in zip(bench.commands, bench.rates.tolist(), strict=True)]
        self._noise = self._drawn(self._draws(self._seed, self._switched))
        self._reading = bytearray(datagrams.reading(Reading(0, 0, 0, (0.0,) * channels)))
        self._values = np.frombuffer(self._reading, "<f8", channels, len(self._reading) - 8 * channels)
        self.condition, self.sequence, self.tick, self.flags, self.limited = OFF, 0, 0, 0, False
        self._trip = 0
        self.put_at(bench.start.x, bench.start.u)
        self._observe()

    @property
    def state(self) -> str:
        """The state, as the link has it: off, on or tripped."""
        return datagrams.STATES[self.condition]

    @property
    def trip(self) -> str | None:
        """Why it tripped, if it did."""
        return self.bench.reason(self._trip) if self._trip else None

    def put_at(self, x: np.ndarray, u: np.ndarray) -> None:
        """At rest in a state [n] with inputs [m], where the drives have held their commands for ever."""
        plant = self.bench.plant
        self.x, self._u, self._p, self._closing = x.copy(), u.copy(), None, 0
        held = u[: plant.commands].copy()
        self.command = held.tolist()
        self._line = DelayLine(plant.lateness(), self.bench.period, held, plant.interpolated)
        self.release()

    def release(self) -> None:
        """Nothing is demanded of the drives."""
        self.demanded = (0.0,) * len(self.command)

    def switch_on(self) -> None:
        """From where it stands; the reading of tick 0 is there then."""
        self._noise = self._drawn(self._draws(self._seed, self._switched))
        self._switched += 1
        self.sample()  # as a loop in simulation: one reading is thrown away
        self._sizes[:] = [self._let_back(limit) for limit in self.bench.limits]
        self.sequence = self.tick = self.flags = 0
        self.condition = ON
        self.sample()

    def _let_back(self, limit: SignalLimit) -> float:
        """The size of a limit: a rig that stands beyond it may be on there, and no further."""
        away = float(abs(self.outputs[self.bench.plant.output(limit.signal)] - limit.middle))
        return away + _FURTHER * limit.size if away > limit.size else limit.size

    def switch_off(self) -> None:
        """The drives close; a rig in lockstep runs on until the jack stands."""
        self.condition = OFF
        self.release()

    def run_out(self) -> None:
        """Go on without anybody for as long as a jack takes to come to rest."""
        for _ in range(round(_RUN_OUT / self.bench.period)):
            self.step()

    def stop(self, trip: int) -> None:
        """Trip: by the number of a limit from 1, or -1 where the plant cannot be simulated on."""
        self.condition, self._trip = TRIPPED, trip

    def reset(self) -> None:
        """After a trip: to rest where the jack stands. Raises InputError where it cannot rest there."""
        rest = self.bench.rest(self.x)
        self.put_at(rest.x, rest.u)
        self._trip, self.condition = 0, OFF

    def take(self, sequence: int, values: tuple[float, ...]) -> None:
        """A command of the client, which a rig that has tripped takes as none."""
        self.sequence, self.demanded = sequence, values
        if self.condition != ON:
            self.release()

    def sample(self) -> None:
        """Read all sensors now. Beyond a limit a rig that is on has tripped."""
        self._observe()
        self._disturbed[:] = next(self._noise)
        self._sense.evaluate()
        self._values[:] = self._sense.found[:-1]
        if self.condition == ON and (limit := int(self._sense.found[-1])):
            self.stop(limit)

    def _observe(self) -> None:
        self.outputs[:] = self._engine.observe(self.x, self._u, self._p)

    def reading(self) -> bytearray:
        """What the sensors said last, as a datagram, which is written anew each time."""
        datagrams.write_head(self._reading, _STATUS[self.condition] | self.flags, self.sequence, self.tick)
        return self._reading

    def step(self) -> None:
        """One period: the demanded commands limited in size and rate, held back by the delay, the plant moved on."""
        bench = self.bench
        if self.condition == TRIPPED and bench.shut_off:
            self._p = closing_parameters(bench.plant, bench.shut_off, self._closing, bench.period)
            self._closing += 1
        self.limited, sent = False, []
        for demanded, command, limits in zip(self.demanded, self.command, self._drives, strict=True):
            sent.append(command + command_change(demanded, command, *limits, min, max))
            self.limited |= abs(sent[-1] - demanded) > _SAME
        self.command = sent
        arriving = self._line.send(np.array(sent))
        after = self._engine.advance_arriving(self.x, self._u, arriving, bench.period, self._p)
        if after is None:
            self.stop(-1)
        else:
            self.x = after

    def _drawn(self, random: Draws) -> Iterator[np.ndarray]:
        """Noise [channels], reading by reading."""
        while True:
            yield from self.bench.noise * random.standard_normal((_ROWS, len(self.bench.channels)))
