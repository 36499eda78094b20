"""What is played on the live rig: recorded, kept, and no longer than is allowed."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from ...base.checkpoint import Stage
from ...base.errors import InputError, LinkLost
from ...base.process_pool import cpu_time
from ...control.controller_spec import ControllerSpec
from ...control.protocol import Controller
from ...control.shell import Around
from ...control.shells import SineShell
from ...loop.drive_simulation import drive
from ...records import Record
from ...records.excitation import Excitation
from ...rigs.rig import Rig
from ..client import LinkClient
from ..course import PlayedCourse, play_course, rest_record
from ..trips import Trip
from ..wire_loop import INTERRUPTED, WireRun
from .obstacles import Barred, cut_short, time_is_over
from .relay import GROWTH, Relay, relay_reference, sine, without_dither

_TRIES = 3  # of a course in which the link loses too many readings
_AROUND = 10.0  # s: the way to where a course starts and back, at most
TRACES = (0.6, 0.85)  # of the time, by which the search of each round's trace ends: controllers are searched after it
AGAIN = 0.6  # of the time, up to which another round may begin


def nothing_wrong(_: Record) -> None:
    """Any record is taken."""


class Computing:
    """A time to compute, `seconds` [s] of CPU time from now on, worker processes' too; `cut`: what it ended, in
    words."""

    def __init__(self, seconds: float, clock: Callable[[], float] = cpu_time) -> None:
        self.seconds, self._clock, self._began, self._waited = seconds, clock, clock(), 0.0
        self.cut: list[str] = []

    @property
    def spent(self) -> float:
        """Until now [s]."""
        return self._clock() - self._began - self._waited

    @contextmanager
    def waits(self) -> Iterator[None]:
        """What takes time and does not count: the rig plays."""
        began = self._clock()
        try:
            yield
        finally:
            self._waited += self._clock() - began

    def over(self, share: float, what: str) -> Callable[[], bool]:
        """Whether a share of the time is over; what that ends is remembered."""

        def is_over() -> bool:
            late = self.spent > share * self.seconds
            if late and what not in self.cut:
                self.cut.append(what)
            return late

        return is_over


class RigTime:
    """What is played on the rig, and for how long: no longer than is allowed. What was kept is not played again.

    `spent` [s], and `log`, what was played in that time; `trips` of rig and guard; `smaller`: scenarios that were made
    smaller or left out, and why; `over`: what there was no time for, or None; `computing`: the computer's time, in
    which the rig's does not count; `dither`: what every loop has on top, where the valve needs it; `last`: the newest
    record, None before the first, and `mark`: when [s] of it a trip was.
    """

    def __init__(
        self, client: LinkClient, rig: Rig, seconds: float, stage: Stage, computing: Computing | None = None
    ) -> None:
        self.client, self.rig, self._seconds, self._stage = client, rig, seconds, stage
        self.computing = computing or Computing(np.inf)
        self.spent, self.log, self.trips = 0.0, list[dict[str, Any]](), list[Trip]()
        self.smaller = list[dict[str, Any]]()
        self.over: str | None = None
        self.last: Record | None = None
        self.mark: float | None = None
        self.dither: SineShell | None = None

    def rest(self, check: Callable[[Record], None]) -> Record:
        """The rig at rest, where nothing is wrong with that."""

        def compute() -> dict[str, Any]:
            with self.computing.waits():
                record = self.last = rest_record(self.client, self.rig)
            try:
                check(record)
            except Barred:
                self._spend("static", "look", float(record.t[-1]))
                raise
            return _stored(record)

        record = self.last = _record("static", self._stage("played-static", compute))
        self._spend("static", "look", float(record.t[-1]))
        return record

    def stay_on(self, stays: bool) -> None:
        """Whether the rig is left on between courses in lockstep, where no time passes then: behind a valve that does
        not close, a jack that is off goes on to its stop. One that is left on may still swing when a course begins."""
        self.client.stays_on = stays
        if not stays:
            self.client.off()

    def free(self, size: float) -> SineShell:
        """From now on every loop has a dither beyond a command `size` [1] that got the jack moving."""
        self.dither = sine(size, self.rig.period.value)
        return self.dither

    def relay(
        self,
        way: float,
        size: float,
        check: Callable[[Record], object],
        blind: bool = False,
        growth: float = GROWTH,
    ) -> Record:
        """A relay that turns at `way` [m], from a command `size` on that grows by `growth` [1/s]: from the middle, or
        where no loop has moved the rig yet, `blind` from where it stands. `check` raises what is wrong with it. Its
        command is the one that answers a reading, so that what lags it lags a loop, and without the dither."""
        period, reference = self.rig.period.value, relay_reference(self.rig, way, growth)

        def play() -> PlayedCourse:
            relay = Relay(drive(self.rig).loop.build(period), period, size, blind, growth)
            loop = relay if self.dither is None else Around(relay, self.dither)
            start = None if blind else self.rig.middle
            return play_course(self.client, self.rig, loop, reference, start, begins=relay.begin, name=name)

        name = f"relay-{1e3 * way:g}mm{'' if self.dither is None else '-dithered'}"
        record = self._whole(name, self._course(name, "look", play, len(reference), check))
        command = record.signals["command"]
        if not self.client.hello.lockstep:
            command = np.append(command[1:], command[-1])
        if self.dither is not None:
            command = without_dither(command, self.dither)
        return replace(record, signals={**record.signals, "command": command})

    def played(self, wave: Excitation, loop: ControllerSpec, why: str) -> Record:
        """An excitation in a loop that holds the jack."""
        start = float(wave.reference[0])
        reference = wave.reference - start

        def play() -> PlayedCourse:
            controller = loop.build(wave.period)
            return play_course(self.client, self.rig, controller, reference, start, wave.command, name=wave.name)

        return self._whole(wave.name, self._course(wave.name, why, play, len(reference), nothing_wrong))

    def course(self, name: str, why: str, spec: ControllerSpec, reference: np.ndarray, start: float) -> PlayedCourse:
        """A controller along deviations `reference` [k] from `start`, cut short or not. Raises Barred where the time is
        over, KeyboardInterrupt and LinkLost."""

        def play() -> PlayedCourse:
            controller: Controller = spec.build(self.rig.period.value)
            return play_course(self.client, self.rig, controller, reference, start, name=name)

        return self._course(name, why, play, len(reference), nothing_wrong)

    def _whole(self, name: str, played: PlayedCourse) -> Record:
        """The record of a course. Raises Barred where the rig or its guard stopped it."""
        if played.ended is not None:
            raise Barred(cut_short(name, played.ended))
        return Record(name, played.record.t, played.record.signals)

    def _course(
        self, name: str, why: str, play: Callable[[], PlayedCourse], rows: int, check: Callable[[Record], object]
    ) -> PlayedCourse:
        """What is played, or was before; once more where the link lost too much of it."""

        def compute() -> dict[str, Any]:
            if self.spent + rows * self.rig.period.value + _AROUND > self._seconds:
                late = time_is_over(self._seconds, self.spent, name)
                self.over = late.what
                raise Barred(late)
            with self.computing.waits():
                played = _unlost(play)
            if played.lost:
                raise LinkLost(f"{name}: {played.ended}, {_TRIES} times")
            self._look(name, played, check)
            return _stored_course(played)

        played = _restored_course(self._stage(f"played-{name}", compute))
        self.last, self.mark = played.record, played.mark
        self._spend(name, why, played.seconds)
        self.trips += [played.trip] if played.trip else []
        return played

    def _look(self, name: str, played: PlayedCourse, check: Callable[[Record], object]) -> None:
        """Check a record that was just played; one in which something is wrong was played too. One that was cut short
        tells little for that reason."""
        self.last, self.mark = played.record, played.mark
        try:
            check(played.record)
        except (InputError, Barred) as wrong:
            self._spend(name, "look", played.seconds)
            if played.trip is not None:
                self.trips.append(played.trip)
            if played.ended is not None and isinstance(wrong, Barred):
                raise Barred(cut_short(name, played.ended)) from wrong
            raise

    def _spend(self, what: str, why: str, seconds: float) -> None:
        self.spent += seconds
        self.log.append({"record": what, "for": why, "seconds": seconds})


def _unlost(play: Callable[[], PlayedCourse]) -> PlayedCourse:
    """A course, played again where the link lost too much of it, but not for ever. Raises KeyboardInterrupt."""
    played = play()
    for _ in range(_TRIES - 1):
        if not played.lost:
            break
        played = play()
    if played.ended == INTERRUPTED:
        raise KeyboardInterrupt
    return played


def _stored(record: Record) -> dict[str, Any]:
    return {"t": record.t, "signals": dict(record.signals)}


def _record(name: str, stored: Mapping[str, Any]) -> Record:
    return Record(name, np.asarray(stored["t"]), {key: np.asarray(x) for key, x in stored["signals"].items()})


def _stored_course(played: PlayedCourse) -> dict[str, Any]:
    """What a stage keeps of a course: all but the way back."""
    run = played.run
    own = {"rows": np.array(run.rows), "readings": np.array(run.readings), "names": list(run.names)}
    rest = {"period": run.period, "ended": played.ended, "level": played.level, "seconds": float(played.seconds)}
    rest |= {"trip": played.trip and played.trip.table(), "mark": played.mark}
    return {**own, **rest, "record": _stored(played.record)}


def _restored_course(stored: Mapping[str, Any]) -> PlayedCourse:
    rows = [(int(tick), *rest) for tick, *rest in np.asarray(stored["rows"]).reshape(-1, 4).tolist()]
    names, ended = tuple(stored["names"]), stored["ended"]
    readings = [tuple(row) for row in np.asarray(stored["readings"]).reshape(-1, len(names)).tolist()]
    run = WireRun(stored["period"], names, rows, readings, ended)
    record = _record("wire", stored["record"])
    trip = None if stored["trip"] is None else Trip(**stored["trip"])
    return PlayedCourse(run, stored["level"], record, None, ended, False, stored["seconds"], trip, stored["mark"])
