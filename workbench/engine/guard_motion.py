"""What readings say of the motion, as a graph: filtered position, speed and force, and the rig's own observer.

The observer adds up, in a window that forgets: displacement by the flow through the valve and the compression of the
oil against the measured one; impulse of the pressures less the load cell against the measured change of speed.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from .guard_shape import GuardShape

Parts = Mapping[str, ca.SX]
_LARGEST = 1.7e308


@dataclass(frozen=True)
class Sample:
    """What a guard sees at a sample: its state `before`, readings y, the command u that the drive got last, the
    reference, and its numbers q."""

    shape: GuardShape
    before: Parts
    y: ca.SX
    u: ca.SX
    reference: ca.SX
    q: Parts

    def read(self, name: str) -> ca.SX:
        """A reading by name."""
        return self.y[self.shape.at(name)]

    def last(self, name: str) -> ca.SX:
        """The reading before."""
        return self.before["last"][self.shape.at(name)]

    @property
    def first(self) -> ca.SX:
        """Whether there is none before."""
        return self.before["count"] < 1

    @property
    def pressed(self) -> ca.SX:
        """Force [N] of the pressures on the piston."""
        return self._pressed(self.y)

    @property
    def strained(self) -> ca.SX:
        """Its change [N] since the sample before."""
        return self.pressed - self._pressed(self.before["last"])

    @property
    def push(self) -> ca.SX:
        """Force [N] that accelerates the mass, of the pressures less the load cell, what the mass weighs and its drag;
        0 where they are not measured."""
        if not self.shape.balances:
            return ca.SX(0)
        return self.pressed - self.read("force") - self.q["weight"] - self.q["drag"] * self.before["v"]

    @property
    def acceleration(self) -> ca.SX:
        """What that makes of the speed [m/s^2]; of a leg what all pushes do."""
        return self.q["pushed"] if self.shape.leg else self.push / self.q["mass"]

    def _pressed(self, y: ca.SX) -> ca.SX:
        return self.q["area_a"] * y[self.shape.at("pa")] - self.q["area_b"] * y[self.shape.at("pb")]


def is_finite(value: ca.SX) -> ca.SX:
    """Whether a number is one."""
    return ca.fabs(value) <= _LARGEST


def estimated(sample: Sample) -> dict[str, ca.SX]:
    """The guard's state after a sample, but for what a trip decides."""
    s, q, position = sample.before, sample.q, sample.read("position")
    astray = ca.fabs(sample.reference - position) > q["following"]
    after = dict(s) | {
        "count": s["count"] + 1,
        "last": sample.y,
        "still": ca.if_else(sample.first, 0, (sample.y == s["last"]) * (s["still"] + 1)),
        "astray": ca.if_else(astray, s["astray"] + 1, 0),
    }
    gain = sample.acceleration * q["period"]
    after["x"], after["v"] = _filtered(sample, position, s["x"], s["v"], gain)
    if "force" in sample.shape.read:  # the push moves the specimen
        after["f"], after["df"] = _filtered(sample, sample.read("force"), s["f"], s["df"], q["specimen"] * gain)
    return after | (_observed(sample, after["v"]) if sample.shape.observes else {})


def _filtered(sample: Sample, reading: ca.SX, value: ca.SX, rate: ca.SX, gain: ca.SX) -> tuple[ca.SX, ca.SX]:
    """A value and its rate: a prediction with the gain of the rate in a period, corrected by what the reading says."""
    q = sample.q
    ahead = value + (rate + gain / 2) * q["period"]
    off = reading - ahead
    return (
        ca.if_else(sample.first, reading, ahead + q["fast"] * off),
        ca.if_else(sample.first, 0, rate + gain + q["slow"] / q["period"] * off),
    )


def _observed(sample: Sample, v: ca.SX) -> dict[str, ca.SX]:
    """What flow and pressures say that the readings should have done, where the speed is v now."""
    s, q = sample.before, sample.q
    spool = s["spool"] + q["lag"] * ((sample.u + q["null"]) * q["travel"] - s["spool"])
    flow = _flow_speed(sample, spool)
    rest = ca.if_else(sample.first, sample.push, s["rest"])
    steps = {
        "gap": sample.read("position") - sample.last("position") - flow * q["period"],
        "travel": ca.fabs(flow) * q["period"],
        "strain": sample.strained,
        "impulse": (sample.push - rest - q["friction"] * v) * q["period"],
        "change": v - s["v"],
    }
    sums = {name: ca.if_else(sample.first, 0, (1 - q["forget"]) * s[name] + step) for name, step in steps.items()}
    started = ca.if_else(sample.first, (sample.u + q["null"]) * q["travel"], spool)
    return sums | {"flow": flow, "rest": rest, "spool": started}


def _flow_speed(sample: Sample, spool: ca.SX) -> ca.SX:
    """Speed [m/s] of a piston on stiff oil by the flows through the lands, where the command says the spool's travel
    [m] and no sensor does."""
    q, read = sample.q, sample.shape.read
    z = sample.read("spool") if "spool" in read else spool
    supply = sample.read("supply") if "supply" in read else q["supply"]
    pa, pb = sample.read("pa"), sample.read("pb")
    shut = ca.fmax(0, 1 - ca.fabs(z) / (2 * q["lap"]))
    leak, wide = q["lap"] * shut * shut, ca.fabs(z) + q["lap"]
    forward, backward = ca.if_else(z >= 0, wide, leak), ca.if_else(z >= 0, leak, wide)
    into_a = q["flow_a"] * (forward * _root(supply - pa) - backward * _root(pa - q["drain"]))
    out_of_b = q["flow_b"] * (forward * _root(pb - q["drain"]) - backward * _root(supply - pb))
    return (into_a + out_of_b) / 2


def _root(drop: ca.SX) -> ca.SX:
    """Signed root [Pa^0.5] of a pressure drop [Pa]: what is above the supply flows back."""
    return drop / ca.sqrt(ca.fabs(drop) + 1.0)
