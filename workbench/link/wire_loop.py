"""A controller of the workbench at a live rig: behind the guard, from where the rig stands, recorded."""

import gc
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from math import nan
from typing import Any

import numpy as np

from ..base.errors import InputError, LinkLost
from ..control.protocol import Controller, preview
from ..loop.compiled_controller import CompiledController, controller_on
from ..loop.guarded_controller import GuardedController
from ..records import Record
from ..rigs.limited import limits_of, nearest_limit
from ..rigs.rig import Rig
from .client import LinkClient
from .datagrams import Reading
from .trips import Trip, trip

INTERRUPTED = "interrupted"
_ENDS = 1.0  # s within which a stopped loop has brought the command to 0
_UNLIKE = 1e-9  # of a value, or of its SI unit: far below what any sensor reads
_FURTHER = 0.005  # of where a jack stands beyond its limit, by which it may go on
_CALM, _WAITS = 0.1, 5.0  # s that a rig that had tripped stands inside its limits, and until when it has to
_NEVER_LATE = 1e-6  # of a period: a command that answers a reading acts after it


class Stopped(Exception):
    """A loop ended before its course did: `why` its guard says, or None where the rig tripped."""

    def __init__(self, why: str | None) -> None:
        super().__init__(why or "")
        self.why = why


@dataclass
class WireRun:
    """What a loop at a rig did, [k] each: ticks, reference, command and what was demanded, and the readings by channel.
    The command is in lockstep the one that answers the reading, and in real time the one that acts from it on.

    `ended`: why it stopped before its course was over, or None; `lost`: whether that was the link; `trip`: what tripped
    it, if it did. `late`: how many readings were lost or late.
    """

    period: float
    names: tuple[str, ...]
    rows: list[tuple[int, float, float, float]] = field(default_factory=list)
    readings: list[tuple[float, ...]] = field(default_factory=list)
    ended: str | None = None
    lost: bool = False
    late: int = 0
    trip: Trip | None = None

    def keep(self, reading: Reading, first: int, reference: float, command: float, demanded: float) -> None:
        """The row of a reading, ticks counted from `first`; a reading has one row."""
        tick = reading.tick - first
        if not self.rows or tick > self.rows[-1][0]:
            self.rows.append((tick, reference, command, demanded))
            self.readings.append(reading.values)

    @property
    def record(self) -> Record:
        """The recording: `t`, `reference`, `command` and the channels, SI. A reading that is no number is 0 there, and
        not valid."""
        table = np.array(self.rows or np.zeros((0, 4)))
        readings = np.array(self.readings).reshape(-1, len(self.names)).T
        numbers = np.isfinite(readings)
        signals = dict(zip(self.names, np.where(numbers, readings, 0.0), strict=True))
        given = {"reference": table[:, 1], "command": table[:, 2]}
        return Record("wire", table[:, 0] * self.period, given | signals, dict(zip(self.names, numbers, strict=True)))

    @property
    def demanded(self) -> np.ndarray:
        """The commands of the controller, before the guard [k]."""
        return np.array([row[3] for row in self.rows])


class WireLoop:
    """A controller, its guard and a rig that is greeted; `run` goes on where the last one ended, `end` switches off.

    A loop that the guard or the rig trips, whose link is lost, that misses readings or that is interrupted goes to
    command 0 by the guard's ramp, and what was recorded is kept. `noisy`: the rig's sensors have noise and resolution,
    as every real one has.
    """

    def __init__(self, client: LinkClient, rig: Rig, controller: Controller, noisy: bool = True) -> None:
        hello = client.hello
        self._client, self._period, self._names = client, hello.period, hello.names
        self._known = tuple(name for name in hello.names if name in rig.sensors)
        check(client, rig, controller)
        self._preview = preview(controller)
        self._loop: CompiledController | GuardedController = controller_on(rig, controller, self._known, noisy)
        self._rig, self._reading = rig, stands(client, rig)
        if (own := _let_back(rig, self.measured)) is not rig:
            self._loop = controller_on(own, controller, self._known, noisy)
        watched = (each for each in rig.further_limits if each.signal in hello.names)
        self._further = [(hello.names.index(each.signal), each) for each in watched]
        self._before = self._reading
        self._sent = {0: 0.0}  # commands by their number
        self._loop.reset(self.measured, 0.0)
        self._controlled = controller.measures[0]

    @property
    def measured(self) -> Mapping[str, float]:
        """The newest readings by channel."""
        return self._by_name(self._reading.values)

    @property
    def level(self) -> float:
        """The controlled signal as it was read last."""
        return self.measured[self._controlled]

    def run(self, reference: np.ndarray, added: np.ndarray | None = None, motion: str = "") -> WireRun:
        """Follow `reference` [k] at the rig's period from now on, with a command `added` [k] to the controller's; a
        trip has the name of the `motion`."""
        run = WireRun(self._period, self._names)
        added = np.zeros(len(reference)) if added is None else added
        ahead = np.append(reference, np.full(self._preview, reference[-1])) if self._preview else None
        self._before, first = self._reading, self._reading.tick

        def asked(k: int) -> tuple[float, float, np.ndarray | None]:
            k = min(k, len(reference) - 1)
            future = None if ahead is None else ahead[k : k + self._preview + 1]
            return float(reference[k]), float(added[k]), future

        try:
            with _undisturbed():
                while (k := self._reading.tick - first) < len(reference):
                    self._pass_over(run, first, len(reference), asked)
                    self._instant(run, first, *asked(k))
                self._pass_over(run, first, len(reference), asked)  # the next run takes up what comes now
        except Stopped as stopped:
            record = run.record
            run.trip = trip(self._rig, record.t, record.signals, stopped.why, motion)
            run.ended = run.trip.words
            self._bring_to_rest(run, first)
        except LinkLost as error:
            run.ended, run.lost = str(error), True
            self._bring_to_rest(run, first)
        except KeyboardInterrupt:
            run.ended = INTERRUPTED
            self._bring_to_rest(run, first)
        return run

    def end(self) -> None:
        """Switch the rig off, unless it stays on."""
        self._client.rest()

    def _instant(self, run: WireRun, first: int, reference: float, added: float, future: np.ndarray | None) -> None:
        """One period: what the newest reading says is answered, and the next one awaited. Raises Stopped, LinkLost."""
        reading = self._reading
        if reading.tripped:
            run.keep(reading, first, reference, 0.0, 0.0)
            raise Stopped(None)
        beyond = self._beyond()
        sent, demanded, _ = self._loop.sample(self.measured, reference, nan if beyond else added, future)
        run.keep(reading, first, reference, self._acting(reading, sent), 0.0 if beyond else demanded)
        self._client.asked = reference, sent
        self._advance(sent, run)
        if (why := beyond or self._loop.tripped) is not None:
            raise Stopped(why)

    def _beyond(self) -> str | None:
        """Which further limit the newest reading is beyond, or the next will be if it changes on as it did."""
        periods = max(1, self._reading.tick - self._before.tick)
        for place, limit in self._further:
            now = self._reading.values[place]
            if not limit.holds(now, (now - self._before.values[place]) / periods):
                return limit.beyond
        return None

    def _acting(self, reading: Reading, sent: float) -> float:
        """The command of a reading's row, where `sent` answers it: in real time the one that the rig says it took last,
        however late that came, and none where its watchdog has fired."""
        if self._client.hello.lockstep:
            return sent
        return 0.0 if reading.watchdog else self._sent.get(reading.sequence, sent)

    def _pass_over(self, run: WireRun, first: int, rows: int, asked: Callable[[int], tuple[float, float, Any]]) -> None:
        """Time goes on for guard and controller over readings that nobody answered; those that came within the run's
        `rows` have theirs."""
        came = {each.tick: each for each in self._client.passed}
        for tick, measured in self._missed(came):
            _, demanded, _ = self._loop.sample(measured, *asked(tick - first))
            if tick in came and tick - first < rows:
                run.keep(came[tick], first, asked(tick - first)[0], self._acting(came[tick], 0.0), demanded)

    def _missed(self, came: Mapping[int, Reading]) -> Iterator[tuple[int, Mapping[str, float]]]:
        """Ticks and readings by channel before the newest one: as they `came`, or where they were lost on a straight
        line between those that were answered, since guard and controller else take the way of several periods for that
        of one. No two are alike, for a sensor that repeats itself is a dead one."""
        before, after = self._before, self._reading
        whole = after.tick - before.tick
        for i in range(1, whole):
            tick = before.tick + i
            if tick in came:
                yield tick, self._by_name(came[tick].values)
                continue
            unlike = _UNLIKE * (-1) ** i
            values = [
                a + (b - a) * i / whole + unlike * max(1.0, abs(b))
                for a, b in zip(before.values, after.values, strict=True)
            ]
            yield tick, self._by_name(values)

    def _by_name(self, values: Sequence[float]) -> Mapping[str, float]:
        """The channels of a reading that the rig's file has too."""
        return {name: x for name, x in zip(self._names, values, strict=True) if name in self._known}

    def _advance(self, command: float, run: WireRun) -> None:
        self._before = self._reading
        self._send(command)
        missed = self._reading.tick - self._before.tick - 1
        run.late += missed
        if missed > self._client.hello.watchdog_periods:
            raise LinkLost(f"{missed} readings in a row were lost or late")

    def _send(self, command: float) -> None:
        """A command, remembered by its number; the next reading."""
        self._sent[self._client.sequence + 1] = command
        self._reading = self._client.exchange((command,))

    def _bring_to_rest(self, run: WireRun, first: int) -> None:
        """The guard's way to command 0, recorded as long as the rig answers."""
        try:
            sent = self._loop.stop(self.measured)
            for _ in range(round(_ENDS / self._period)):
                run.keep(self._reading, first, self.level, self._acting(self._reading, sent), 0.0)
                self._send(sent)
                if sent == 0:
                    return
                sent, _, _ = self._loop.sample(self.measured, self.level)
        except (LinkLost, KeyboardInterrupt):
            return


def stands(client: LinkClient, rig: Rig) -> Reading:
    """Switch the rig on: the reading from which on it stands inside all its limits but that of the stroke, into which
    it has to get back by itself. Only a rig that had tripped, or that is beyond a limit, is waited for. Raises
    InputError for one that stays outside, or has an inner loop; LinkLost."""
    if rig.inner:
        raise InputError(
            f"--at {client.at}: {rig.name} has an inner loop, whose reference a trip of the guard would set to 0, and "
            "so move the jack; play what it is asked by its maker's program, or write the valve's own command"
        )
    limits = tuple(each for each in limits_of(rig) if each.signal != "position")
    names, period = client.hello.names, client.hello.period
    needed, seen, reading = max(2, round(_CALM / period)), list[Reading](), client.on()
    calm, worst = 0 if client.was_reset else needed, None
    for _ in range(round(_WAITS / period)):
        seen = [*seen[1 - needed :], reading]
        signals = {name: np.array([value]) for name, value in zip(names, reading.values, strict=True)}
        if len(seen) == needed and "position" in names:
            place = names.index("position")
            gone = reading.values[place] - seen[0].values[place]
            signals["velocity"] = np.array([gone / (needed - 1) / period])
        worst = nearest_limit(limits, signals)
        calm = 0 if reading.tripped or (worst is not None and worst.share > 1) else calm + 1
        if calm > needed:
            return reading
        reading = client.exchange((0.0,))
        if reading.tripped and len(seen) == needed:
            reading, seen = client.on(), []
    where = f": {worst.limit.text(worst.value)}" if worst is not None else ""
    raise InputError(f"{client.at}: the rig does not come back inside its limits{where}; look at what holds it there")


def acts_after_its_row(hello_period: float, lockstep: bool, computing: float) -> float:
    """How late [s] the command of a recorded row acts after its reading was taken: see `WireRun`."""
    return acts_after(hello_period, lockstep, computing) if lockstep else _NEVER_LATE * hello_period


def acts_after(hello_period: float, lockstep: bool, computing: float) -> float:
    """How late [s] a command acts that answers a reading: after the rig's computing delay in lockstep, and after one
    period in real time; a trifle more, since the reading was taken before."""
    return (computing if lockstep else hello_period) + _NEVER_LATE * hello_period


def _let_back(rig: Rig, measured: Mapping[str, float]) -> Rig:
    """The rig; where the jack stands beyond its stroke limit, as one that drifted while it was off, with a limit just
    beyond that: it may be on there and no further, since it has to get back."""
    away = abs(measured.get("position", rig.middle) - rig.middle)
    limit = rig.limits.get("stroke")
    if limit is None or away <= limit.value:
        return rig
    return replace(rig, limits={**rig.limits, "stroke": replace(limit, value=away * (1 + _FURTHER))})


def check(client: LinkClient, rig: Rig, controller: Controller) -> None:
    """Raises InputError for a rig on the wire that is not the one of the experiment."""
    hello = client.hello
    if len(hello.commands) != 1:
        raise InputError(f"--at {client.at}: {hello.rig} takes {len(hello.commands)} commands; a loop here has one")
    if abs(hello.period / rig.period.value - 1) > 1e-6:
        own, its = 1 / rig.period.value, 1 / hello.period
        raise InputError(
            f"--at {client.at}: {hello.rig} runs at {its:g} Hz, the experiment's rig at {own:g} Hz; set one"
        )
    for name in controller.measures:
        if name not in hello.names:
            raise InputError(f"--at {client.at}: {hello.rig} has no channel {name}, which the controller needs")


@contextmanager
def _undisturbed() -> Iterator[None]:
    """No garbage collection between samples."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()
