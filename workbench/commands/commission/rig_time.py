"""What is played on the live rig: recorded, kept, and no longer than is allowed."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...link.client import LinkClient
from ...link.course import Played, play_course
from ...records import Record
from ...records.excitation import Excitation
from ...rigs.rig import Rig
from ..common.run_folder import Run
from ..excite.study import drive
from .relay import Relay, relay_reference
from .verify import check_ended


class RigTime:
    """What is played on the rig, and for how long: no longer than is allowed. A record that was kept is not played
    again."""

    def __init__(self, client: LinkClient, rig: Rig, seconds: float, run: Run) -> None:
        self.client, self.rig, self._seconds, self.run = client, rig, seconds, run
        self.spent, self.log = 0.0, list[dict[str, Any]]()

    def spend(self, what: str, why: str, seconds: float) -> None:
        """Note what was played. Raises InputError where it was more than is allowed."""
        self.spent += float(seconds)
        self.log.append({"record": what, "for": why, "seconds": float(seconds)})
        if self.spent > self._seconds:
            raise InputError(f"--minutes: {self.spent / 60:.2g} are over after {what}; allow more")

    def kept(self, name: str, why: str, play: Callable[[], Record]) -> Record:
        """A record, of this run or of the one that it resumes."""

        def compute() -> dict[str, Any]:
            record = play()
            return {"t": record.t, "signals": dict(record.signals)}

        stored = self.run.stage(f"played-{name}", compute)
        record = Record(name, np.asarray(stored["t"]), {key: np.asarray(x) for key, x in stored["signals"].items()})
        self.spend(name, why, record.t[-1])
        return record

    def played(self, wave: Excitation, loop: ControllerSpec, why: str) -> Record:
        """An excitation in a loop that holds the jack."""
        start, controller = float(wave.reference[0]), loop.build(wave.period)
        reference = wave.reference - start
        play = partial(play_course, self.client, self.rig, controller, reference, start, wave.command)
        return self._kept_course(wave.name, why, play)

    def relay(self, way: float, size: float) -> Record:
        """A relay that turns at `way` [m] from the middle, from a command `size` on."""
        period = self.rig.period.value
        relay, middle = Relay(drive(self.rig).loop.build(period), period, size), self.rig.middle
        name, reference = f"relay-{1e3 * way:g}mm", relay_reference(self.rig, way)
        play = partial(play_course, self.client, self.rig, relay, reference, middle, begins=relay.begin)
        return self._kept_course(name, "look", play)

    def _kept_course(self, name: str, why: str, play: Callable[[], Played]) -> Record:
        """Raises InputError where the rig or its guard stops it, and KeyboardInterrupt."""

        def course() -> Record:
            done = play()
            check_ended(name, done.ended)
            return done.record

        return self.kept(name, why, course)
