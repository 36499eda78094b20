"""The guard that every loop passes through (limits of the rig on what is commanded, trips on what is measured), and a
controller behind it, asked once a sample: in a simulated loop, and at a rig on the wire.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isfinite, nan
from numbers import Real
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import InputError
from ..base.units import from_si
from ..control.compensators import innermost
from ..control.protocol import Controller
from ..engine.guard_shape import packed
from ..rigs.rig import Rig
from .guard_numbers import guard_numbers, guard_shape, trip_reason

if TYPE_CHECKING:
    from ..engine.guard_rules import GuardSteps

STOPPED = "stopped"


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
        from ..engine.guard_rules import GuardSteps  # here: what only reads an experiment needs no graph

        shape = guard_shape(self._rig, tuple(signals), self._measures)
        numbers = guard_numbers(self._rig, shape, self._measures, self._noisy)
        return GuardSteps(shape, packed(shape.numbers, **numbers))


class GuardedController:
    """A controller and its guard on a rig, in Python. One that fails, or misses the rig's deadline, trips the guard;
    at the start it is an InputError.

    The deadline counts from the second sample on: in the first a controller may build what it needs. `noisy`: readings
    have noise and resolution. `now` [ns] is the clock by which it is timed.
    """

    def __init__(self, rig: Rig, controller: Controller, noisy: bool, now: Callable[[], int] = perf_counter_ns) -> None:
        self.controller, self.guard = controller, Guard(rig, controller.measures, noisy)
        self.name = type(innermost(controller)).__name__
        self._deadline, self._now = rig.deadline, now
        self._started, self._failure = False, None

    _failure: str | None

    @property
    def tripped(self) -> str | None:
        """Why the guard tripped, if it did."""
        return self.guard.tripped

    def reset(self, measured: Mapping[str, float], command: float) -> None:
        """Start from readings, where the drive holds a command."""
        self.guard.reset(command)
        self._told("reset", measured[self.controller.measures[0]], measured, command)

    def sample(
        self, measured: Mapping[str, float], reference: float, added: float = 0.0, future: np.ndarray | None = None
    ) -> tuple[float, float, float]:
        """One sampling instant: the command that is sent to the drive now, what was demanded with `added`, and how long
        the controller took [us], 0 after a trip. `future` is the reference from now on, where it is known ahead."""
        guard = self.guard
        guard.watch(measured, reference)
        if guard.tripped is not None:
            return guard.limit(Guard.safe), Guard.safe, 0.0
        began = self._now()
        demanded = self._demanded(reference, measured, future) + added
        computed = self._now()
        if self._is_late((computed - began) * 1e-9):
            demanded = nan
        sent = guard.limit(demanded, self._failure)
        limited = self._now()
        if guard.tripped is None:
            self._told("update", sent - added)
            self._started = True
        return sent, demanded, (self._now() - began - limited + computed) / 1e3

    def stop(self, measured: Mapping[str, float]) -> float:
        """Trip the guard without asking the controller; the command to send."""
        self.guard.watch(measured)
        return self.guard.limit(nan, STOPPED)

    def _is_late(self, spent: float) -> bool:
        """Whether a controller that computed for `spent` [s] missed the rig's deadline; it has failed then."""
        limit = self._deadline
        if not self._started or limit is None or spent <= limit.value:
            return False
        took = float(from_si(spent, limit.unit, limit.si))
        late = f"the controller missed its deadline of {limit.shown:g} {limit.unit}: it took {took:.3g}"
        self._failure = self._failure or late
        return True

    def _demanded(self, reference: float, measured: Mapping[str, float], future: np.ndarray | None) -> float:
        """What the controller computes. Raises InputError for one that fails, returns what is no number, or starts with
        one that is not finite; later any of these trips the guard."""
        if future is not None:
            self._told("set_preview", future)
        demanded = self._told("compute", reference, measured)
        if self._failure:
            return nan
        if isinstance(demanded, Real) and (self._started or isfinite(demanded)):
            return float(demanded)
        what = f"{demanded} at the start" if isinstance(demanded, Real) else f"{type(demanded).__name__}, no number"
        self._fail(f"{self.name}.compute: returns {what}", "return the command, -1 to 1")
        return nan

    def _told(self, method: str, *arguments: Any) -> Any:
        """A method of the controller, None where it fails."""
        try:
            return getattr(self.controller, method)(*arguments)
        except Exception as error:
            self._fail(f"{self.name}.{method}: {type(error).__name__}: {error}", "mend the controller", error)
            return None

    def _fail(self, what: str, advice: str, cause: Exception | None = None) -> None:
        """The controller failed: at the start an InputError, later a reason to trip."""
        if not self._started:
            raise InputError(f"{what}; {advice}") from cause
        self._failure = self._failure or what
