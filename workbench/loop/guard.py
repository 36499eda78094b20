"""The guard that every loop passes through: limits of the rig on what is commanded, and trips on what is measured."""

import math
from collections.abc import Mapping

from ..rigs.rig import Rig


def max_move_per_period(rig: Rig) -> float:
    """How far [m] the measured position may move in one period: at the speed limit, with room for the sensor's noise.

    The room is six standard deviations of the difference of two readings, and one step of the resolution.
    """
    sensor = rig.sensors.get("position")
    room = 6 * math.sqrt(2) * sensor.noise + sensor.resolution if sensor else 0.0
    return rig.limit("speed") * rig.period.value + room


class Guard:
    """Limits the command to +-1 and to the rig's rate, and trips to command 0 when the rig leaves its limits.

    A limit acts where its signal is measured: the force limit needs a force sensor. Reset the guard at the start of a
    loop. A trip latches: from then on the command goes to 0 at the allowed rate.
    """

    safe = 0.0

    def __init__(self, rig: Rig) -> None:
        self._stroke, self._speed, self._force = rig.limit("stroke"), rig.limit("speed"), rig.limit("force")
        self._stride = max_move_per_period(rig)
        self._position_signal, self._speed_signal = rig.signal("position"), rig.signal("velocity")
        self._centre = "mid stroke" if rig.is_jack else "rest"
        self._middle, self._period = rig.middle, rig.period.value
        self._step = rig.limit("command_rate") * self._period
        self.reset(self.safe)

    def reset(self, command: float) -> None:
        """Forget the past; `command` [1] is what the drive holds now."""
        self._command = command
        self._position: float | None = None
        self._known: set[str] = {"position"}
        self.tripped: str | None = None

    def numbers(self) -> dict[str, float]:
        """The limits as parameters of a compiled loop, SI: middle and half of the stroke, largest move and change of
        the command in a period, force."""
        return {
            "middle": self._middle,
            "stroke": self._stroke,
            "move": self._stride,
            "force": self._force,
            "step": self._step,
        }

    def reason(self, limit: str) -> str:
        """Why the guard tripped, in words, for the limit that was passed: stroke, speed, force or command."""
        return {
            "stroke": f"position beyond +-{self._position_signal.text(self._stroke)} of {self._centre}",
            "speed": f"speed above {self._speed_signal.text(self._speed)}",
            "force": f"force above {self._force / 1e3:g} kN",
            "command": "the controller's command is not finite",
        }[limit]

    def watch(self, measurement: Mapping[str, float]) -> None:
        """Trip, with the reason in `tripped`, on a lost or non-finite signal or one beyond the rig's limits (SI)."""
        if self.tripped is None:
            self.tripped = self._reason(measurement)
        self._position = measurement.get("position")

    def limit(self, demanded: float) -> float:
        """The command [1] that the drive gets for the demanded one: limited in size and rate, safe after a trip."""
        if self.tripped is None and not math.isfinite(demanded):
            self.tripped = self.reason("command")
        target = self.safe if self.tripped else min(1.0, max(-1.0, demanded))
        self._command += min(self._step, max(-self._step, target - self._command))
        return self._command

    def _reason(self, measurement: Mapping[str, float]) -> str | None:
        if measurement.keys() != self._known:
            if lost := self._known.difference(measurement):
                return f"the {min(lost)} signal is lost"
            self._known.update(measurement)
        if not math.isfinite(sum(measurement.values())):  # one look for all of them; only then one by one
            for name, value in measurement.items():
                if not math.isfinite(value):
                    return f"the {name} signal is not finite"
        position = measurement["position"]
        if abs(position - self._middle) > self._stroke:
            return self.reason("stroke")
        if self._position is not None and abs(position - self._position) > self._stride:
            return self.reason("speed")
        if abs(measurement.get("force", 0.0)) > self._force:
            return self.reason("force")
        return None
