"""The guard that every loop passes through: limits of the rig on what is commanded, and trips on what is measured."""

from collections.abc import Iterable, Mapping, Sequence
from math import nan
from typing import TYPE_CHECKING

from ..engine.guard_shape import packed
from ..rigs.rig import Rig
from .guard_numbers import guard_numbers, guard_shape, trip_reason

if TYPE_CHECKING:
    from ..engine.guard_steps import GuardSteps


class Guard:
    """Limits the command to +-1 and to the rig's rate, and trips when the rig leaves its limits, can no longer stop
    within its stroke, or when its signals cannot be believed: the rules are in engine/guard_rules.

    A rule acts where its signals are measured: the force limit needs a force sensor. `measures` are signals that the
    controller needs beside those of the rules; `noisy` says that sensors have noise and resolution, without which
    repeated readings mean nothing. Reset the guard at the start of a loop. A trip latches: from then on the command
    goes to the opening that brakes the jack, and from there to 0 at a rate that keeps its force below the limit.
    """

    safe = 0.0

    def __init__(self, rig: Rig, measures: Sequence[str] = (), noisy: bool = False) -> None:
        self._rig, self._measures, self._noisy = rig, tuple(measures), noisy
        self._rules: GuardSteps | None = None
        self.reset(self.safe)

    def reset(self, command: float) -> None:
        """Forget the past; `command` [1] is what the drive holds now."""
        self._command = command
        self._known: set[str] = {"position"}
        self.tripped: str | None = None
        if self._rules:
            self._rules.reset()

    @property
    def speed(self) -> float:
        """The speed [m/s] that readings say so far."""
        return self._rules.speed if self._rules else 0.0

    def watch(self, measurement: Mapping[str, float], reference: float = nan) -> None:
        """Trip, with the reason in `tripped`, on a lost or non-finite signal or one beyond the rig's limits (SI), or
        where the position stays too far from the `reference` of a loop that controls it."""
        lost = self._lost(measurement)
        if self._rules is None:
            self._rules = self._steps(measurement)
        trip = self._rules.watch(measurement, self._command, reference)
        if self.tripped is None and trip:
            self.tripped = lost or trip_reason(self._rig, trip)

    def limit(self, demanded: float, failure: str | None = None) -> float:
        """The command [1] that the drive gets for the demanded one: limited in size and rate, safe after a trip.

        `failure`: why there is no demanded command, in words, where the controller failed.
        """
        rules = self._rules or self._steps(("position",))
        self._command, trip = rules.limit(demanded, self._command)
        if self.tripped is None and trip:
            self.tripped = failure or trip_reason(self._rig, trip)
        return self._command

    def _lost(self, measurement: Mapping[str, float]) -> str | None:
        if measurement.keys() != self._known:
            if lost := self._known.difference(measurement):
                return f"the {min(lost)} signal is lost"
            self._known.update(measurement)
        return None

    def _steps(self, signals: Iterable[str]) -> "GuardSteps":
        from ..engine.guard_steps import GuardSteps  # here: what only reads an experiment needs no graph

        shape = guard_shape(self._rig, tuple(signals), self._measures)
        numbers = guard_numbers(self._rig, shape, self._measures, self._noisy)
        return GuardSteps(shape, packed(shape.numbers, **numbers))
