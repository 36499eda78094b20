"""A rig that is served: its state in places that machine code reads and writes, period by period."""

import ctypes
import socket
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from ..engine import periods
from ..loop.sensors import draws
from . import datagrams
from .bench import Bench
from .machine_code import LinkJob, RigCode, rig_code, set_addresses

_PACKET = 2048  # bytes of a datagram that is looked at, as rig.ll has it
_ROWS = 256  # readings whose noise is drawn ahead
_BINS = 100_000  # microseconds: later is in the last
_WATCHDOG = 0.05  # s without a command, and at least
_LEAST_WATCHDOG = 10  # periods
_RUN_OUT = 1.0  # s that a rig in lockstep runs on after it was switched off
_FURTHER = 0.005  # of a limit, by which a rig that stands beyond it may go on
OFF, ON, TRIPPED = range(3)


class Draws(Protocol):
    """Where the noise of readings comes from."""

    def standard_normal(self, size: tuple[int, int]) -> np.ndarray:
        """Numbers [rows, channels] of variance 1, which follow those drawn before."""
        ...


class ServedRig:
    """A bench in service: off, on or tripped. Noise is drawn from `seed`, anew at each "on"; by `noise`, a function of
    the seed and how often it was switched on, which is white unless another is given.

    The plant's state x [n], what its commands [m] are limited to, and the last reading's bytes are those of the machine
    code. Raises NotCompiled, OSError or RuntimeError where this machine cannot compile.
    """

    def __init__(self, bench: Bench, seed: int, noise: Callable[[int, int], Draws] = draws) -> None:
        self.bench, self._seed, self._switched, self._noise = bench, seed, 0, noise
        self.code: RigCode = rig_code()
        self._stepping = bench.engine.stepping()
        self.job, self._arrays = LinkJob(), dict[str, np.ndarray]()
        self.address = ctypes.addressof(self.job)
        self._connect()
        self._set_numbers()
        self._draws = noise(seed, 0)
        self.put_at(bench.start.x, bench.start.u)

    @property
    def state(self) -> str:
        """As the link has it: off, on or tripped."""
        return datagrams.STATES[self.job.state]

    @property
    def x(self) -> np.ndarray:
        """The plant's state [n]."""
        return self._stepping.buffers.x

    @property
    def outputs(self) -> np.ndarray:
        """The true outputs at the last sample."""
        return self._stepping.buffers.y

    @property
    def command(self) -> np.ndarray:
        """The commands [m] as limited."""
        return self._arrays["command"]

    @property
    def reading(self) -> bytes:
        """The last one, as it is sent."""
        return self._arrays["reading"].tobytes()

    @property
    def packet(self) -> bytes:
        """The datagram that came last."""
        return self._arrays["packet"][: max(self.job.length, 0)].tobytes()

    @property
    def sender(self) -> bytes:
        """The address that it came from, as the socket gave it."""
        return self._arrays["address"].tobytes()

    def take_owner(self) -> None:
        """Commands are taken from the sender of the last datagram from now on."""
        self._arrays["owner"][:] = self._arrays["address"]
        self.job.owner_length = self.job.address_length

    @property
    def trip(self) -> str | None:
        """Why it tripped, if it did."""
        return self.bench.reason(self.job.trip) if self.job.trip else None

    def put_at(self, x: np.ndarray, u: np.ndarray) -> None:
        """At rest in a state [n] with inputs [m], where the drives have held their commands for ever."""
        buffers = self._stepping.buffers
        buffers.x[:], buffers.u[:] = x, u
        m = self.job.commands
        self.command[:] = u[:m]
        self._arrays["demanded"][:] = 0.0
        self._arrays["line"].reshape(-1, m)[:] = u[:m]
        buffers.p[:] = self.bench.plant.p
        self.job.closed = 0.0

    def switch_on(self) -> None:
        """From where it stands; the reading of tick 0 is there then."""
        self._draws = self._noise(self._seed, self._switched)  # as a loop in simulation: one reading is thrown away
        self._switched += 1
        job = self.job
        job.normal_row = job.normal_rows
        self.draw_noise()
        self.code.sample(self.address)
        self._let_back()
        job.sequence = job.tick = job.flags = job.silent = job.fresh = job.overtaken = 0
        job.state = ON
        self.code.sample(self.address)

    def switch_off(self) -> None:
        """The drives close; a rig in lockstep runs on until the jack stands."""
        self.job.state = OFF
        self._arrays["demanded"][:] = 0.0

    def run_out(self) -> None:
        """Go on without anybody for as long as a jack takes to come to rest."""
        for _ in range(round(_RUN_OUT / self.bench.period)):
            self.code.step(self.address)

    def reset(self) -> None:
        """After a trip: to rest where the jack stands. Raises InputError where it cannot rest there."""
        rest = self.bench.rest(self.x)
        self.put_at(rest.x, rest.u)
        self.job.trip, self.job.state = 0, OFF

    def _let_back(self) -> None:
        """A rig that stands beyond a limit may be on there, and no further: it has to get back."""
        away = np.array(
            [abs(self.outputs[self.bench.plant.output(each.signal)] - each.middle) for each in self.bench.limits]
        )
        size = np.array([each.size for each in self.bench.limits])
        self._arrays["limit_size"][:] = np.where(away > size, away + _FURTHER * size, size)

    def draw_noise(self) -> None:
        """Normal numbers for the readings to come, those that are left first."""
        normal, job = self._arrays["normal"].reshape(_ROWS, -1), self.job
        left = normal[job.normal_row : job.normal_rows].copy()
        normal[: len(left)] = left
        normal[len(left) :] = self._draws.standard_normal((_ROWS - len(left), normal.shape[1]))
        job.normal_row, job.normal_rows = 0, _ROWS

    def histogram(self, name: str) -> np.ndarray:
        """How often a time was so many microseconds: `jitter` of readings, `ages` of commands."""
        return self._arrays[name]

    def _connect(self) -> None:
        """The places of the machine code."""
        bench, stepping = self.bench, self._stepping
        plant, buffers, m, c = bench.plant, stepping.buffers, bench.plant.commands, len(bench.channels)
        whole, part = periods(plant.lateness(), bench.period)
        shut, n = bench.shut_off, "n"
        valve = [plant.parameters.index(n) if shut and n in plant.parameters else -1] * m
        self._arrays = {
            "columns": np.array([plant.output(name) for name in bench.channels], np.int64),
            "noise": bench.noise.copy(),
            "resolution": bench.resolution.copy(),
            "normal": np.zeros(_ROWS * c),
            "limit_column": np.array([plant.output(limit.signal) for limit in bench.limits], np.int64),
            "limit_middle": np.array([limit.middle for limit in bench.limits]),
            "limit_size": np.array([limit.size for limit in bench.limits]),
            "low": np.array([each.low for each in bench.commands]),
            "high": np.array([each.high for each in bench.commands]),
            "rate": bench.rates.copy(),
            "command": np.zeros(m),
            "demanded": np.zeros(m),
            "line": np.zeros((whole + 2) * m),
            "valve_place": np.array(valve, np.int64),
            "valve_open": np.array([plant.p[place] for place in valve]),
            "valve_leak": np.full(m, shut.leak.value if shut else 0.0),
            "valve_time": np.full(m, shut.closing_time.value if shut else 1.0),
            "packet": np.zeros(_PACKET, np.uint8),
            "address": np.zeros(128, np.uint8),
            "owner": np.zeros(128, np.uint8),
            "reading": np.frombuffer(bytearray(datagrams.reading(datagrams.Reading(0, 0, 0, (0.0,) * c))), np.uint8),
            "jitter": np.zeros(_BINS, np.int64),
            "ages": np.zeros(_BINS, np.int64),
        }
        own = {"x": buffers.x, "u": buffers.u, "p": buffers.p, "y": buffers.y, "duration": buffers.duration}
        set_addresses(self.job, **self._arrays, **own, failed=buffers.failed, reached=buffers.reached)
        job, run_job, output_job = self.job, buffers.run_job, buffers.output_job
        job.run, job.outputs, job.run_job, job.output_job = (
            stepping.library["run"], stepping.library["outputs"], buffers.run_address, buffers.output_address,
        )  # fmt: skip
        job.run_next = buffers.run_address + type(run_job).next.offset
        job.first_step = buffers.run_address + type(run_job).first_step.offset
        job.output_next = buffers.output_address + type(output_job).next.offset
        job.late, job.part, job.interpolated = whole, part, int(plant.interpolated and bool(part))
        job.first_part, job.second_part = part * bench.period, (1 - part) * bench.period

    def _set_numbers(self) -> None:
        job, bench = self.job, self.bench
        job.period, job.period_ns = bench.period, round(bench.period * 1e9)
        job.states, job.commands, job.channels = bench.plant.n, bench.plant.commands, len(bench.channels)
        job.limits, job.normal_row, job.normal_rows = len(bench.limits), _ROWS, _ROWS
        job.reading_size, job.asked, job.refused = len(self._arrays["reading"]), -1, -1
        job.watchdog = max(_LEAST_WATCHDOG, round(_WATCHDOG / bench.period))
        job.jitter_bins = job.age_bins = _BINS
        job.clock_id, job.dontwait = time.CLOCK_MONOTONIC, getattr(socket, "MSG_DONTWAIT", 0)
