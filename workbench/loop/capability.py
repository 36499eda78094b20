"""What a rig can give a motion: acceleration and speed by its supply, and the mode of the mass on the oil."""

from dataclasses import dataclass

import numpy as np

from ..rigs.number import Number
from ..rigs.rig import Rig

SHARE = 0.8  # of force and flow that a planned motion takes: the rest is the loop's


@dataclass(frozen=True)
class Capability:
    """A rig's acceleration from rest `a0` [m/s^2] and steady speed `v0` [m/s] at full command, both without a load and
    in the weaker direction; its speed `limit` [m/s]; the natural frequency `mode` [Hz] of its mass on the oil at mid
    stroke.

    The flow through the valve's lands goes with the root of the pressure that is left for them: at a speed v the
    acceleration is a0 (1 - (v/v0)^2) at most (Merritt, Hydraulic Control Systems, 1967, ch. 5). Braking throttles, up
    to a0.
    """

    a0: float
    v0: float
    limit: float
    mode: float

    def acceleration(self, speed: np.ndarray | float) -> np.ndarray | float:
        """The most [m/s^2] at speeds [m/s]; below 0 where the valve does not give the speed."""
        return self.a0 * (1 - (speed / self.v0) ** 2)

    def speed(self, acceleration: float) -> float:
        """The most [m/s] at an acceleration [m/s^2] up to a0, within the rig's limit."""
        return min(self.limit, self.v0 * float(np.sqrt(max(0.0, 1 - acceleration / self.a0))))

    def sine_amplitude(self, frequency: float) -> float:
        """The most [m] at a frequency [Hz]: at its ends a sine takes a0 at most, in between what speed leaves of it."""
        w = 2 * np.pi * frequency
        accelerated = self.a0 / w**2
        if accelerated > self.v0**2 / (2 * self.a0):  # where the valve saturates is in between
            accelerated = self.v0 / w * float(np.sqrt(max(0.0, 1 - (w * self.v0 / (2 * self.a0)) ** 2)))
        return min(accelerated, self.limit / w)

    def sine_frequency(self, amplitude: float) -> float:
        """The highest [Hz] at which an amplitude [m] is within reach: where the valve saturates."""
        square = self.a0 / amplitude
        if amplitude > self.v0**2 / (2 * self.a0):
            square = self.a0 / (self.a0 * (amplitude / self.v0) ** 2 + self.v0**2 / (4 * self.a0))
        return min(float(np.sqrt(square)), self.limit / amplitude) / (2 * np.pi)

    @property
    def corner(self) -> tuple[float, float]:
        """Speed and acceleration at which the valve gives the most power, or at the rig's speed limit."""
        speed = min(self.limit, self.v0 / 3**0.5)
        return speed, float(self.acceleration(speed))


def capability(rig: Rig, share: float = 1.0, load: float = 0.0) -> Capability:
    """What a rig gives with a share of its force and of its flow against a load [N]."""
    from ..linear.operating_point import equilibrium  # here: what only reads an experiment builds no plant
    from ..plant import build

    plant, weaker = build(rig), min(stall_force(rig, sign) for sign in (1.0, -1.0))
    v0 = min(abs(equilibrium(plant, command=sign).speed) for sign in (1.0, -1.0))
    mode = np.sqrt(oil_stiffness(rig) / rig["M"]) / (2 * np.pi)
    return Capability((share * weaker - abs(load)) / rig["M"], share * v0, rig.limit("speed"), float(mode))


def stall_force(rig: Rig, sign: float) -> float:
    """Force [N] with the supply on the driving side and the return on the other."""
    driving, driven = rig.areas[:: int(sign)]
    return rig["Ps"] * driving - rig["Pr"] * driven


def oil_stiffness(rig: Rig) -> float:
    """The stiffness of the oil in both chambers [N/m] at mid stroke: the sum of beta A^2/V."""
    areas = np.array(rig.areas)
    return float(np.sum(rig["beta"] * areas**2 / (np.array(rig.dead_volumes) + areas * rig["S"] / 2)))


def dead_zone(rig: Rig) -> Number | None:
    """Share of the spool's travel, either side of null, in which lands that overlap let nothing through: as a rig
    declares it or was found to have it, by its main.deadband; None without."""
    from ..plant.effects import numbers_of  # here: what only reads an experiment builds no plant

    return numbers_of(rig).get("main.deadband.overlap")
