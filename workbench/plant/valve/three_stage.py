"""Three-stage valve: pilot, main spool in its end chambers, and the electrical position loop (paper, section 2)."""

from collections.abc import Mapping
from dataclasses import replace

import casadi as ca

from ...rigs.rig import Rig
from ..assembly import Assembly
from ..orifice import curtain, exponential_lap, flow_force, land_flows, root, spool_stop, volume
from .kind import ProbePoint, Valve
from .lands import Lands, PilotFlows, ValveFlows, main_flows, main_openings


def pilot_stage(b: Assembly, current: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> PilotFlows:
    """Torque motor, flapper and pilot spool driven by `current` [A]; the nozzles are fed from `supply` [Pa]."""
    theta = b.state("theta", "rad", 5e-3)
    w = b.state("w", "rad/s", 5.0)
    feed = b.magnitude("Ps")
    pg = b.state("Pg2", "Pa", feed, 0.6 * feed)
    pd = b.state("Pd2", "Pa", feed, 0.6 * feed)
    z = b.state("z2", "m", 3e-4)
    v = b.state("v2", "m/s", 0.1)
    torque = b["Km"] * b.slot("motor_current", current)
    spring = b["Kr2"] * (z + b["L"] * theta)
    b.rate("theta", w)
    b.rate("w", (torque - _armature_load(b, theta, w, spring, pg - pd)) / b["J"])
    _nozzle_chambers(b, theta, (pg, pd), (z, v), (supply, drain))
    openings = (exponential_lap(z, b["eps"]), exponential_lap(-z, b["eps"]))
    ports = (lands.a, lands.b)
    force = b["S2"] * (pg - pd) - b["psi2"] * v - spring - b["Fs2"] * ca.tanh(v / 1e-3)
    force -= flow_force(openings, b["cff2"], ports, lands.supply, lands.drain)
    force -= spool_stop(z, v, b["z2max"], b["k2stop"], b["M2"])
    b.rate("z2", v)
    b.rate("v2", force / b["M2"])
    b.dry_friction("Fs1", "Fs2")
    into_a, out_of_b = land_flows(openings, b["K2"], ports, lands.supply, lands.drain)
    signals = {"pilot_spool": z, "flapper": b["l"] * theta}
    return PilotFlows(into_a, out_of_b, ca.fmin(pg, pd), signals)


def _armature_load(b: Assembly, theta: ca.SX, w: ca.SX, spring: ca.SX, drop: ca.SX) -> ca.SX:
    """Torque [N m] against the motor: damping, feedback spring, net stiffness, nozzle pressure, friction, stop."""
    arm = b["l"]
    stop = b["kstop"] * arm * ca.fmax(ca.fabs(arm * theta) - b["xo"], 0) * ca.sign(theta)
    pressure = b["Sbuse"] * arm * drop
    friction = b["Fs1"] * ca.tanh(w / 0.05)
    return b["phi"] * w + spring * b["L"] + b["Knet"] * theta + pressure + friction + stop


def _nozzle_chambers(
    b: Assembly, theta: ca.SX, pressures: tuple[ca.SX, ca.SX], spool: tuple[ca.SX, ca.SX], feed: tuple[ca.SX, ca.SX]
) -> None:
    """Continuity of the two nozzle chambers, which move the pilot spool."""
    (pg, pd), (z, v), (supply, drain) = pressures, spool, feed
    nozzle = b["Kbuse"] * ca.pi * b["Dbuse"]
    offset = b["l"] * theta
    inlet = b["K1"] + b["Kf2"]
    left = inlet * root(supply - pg) - nozzle * curtain(b["xo"] - offset) * root(pg - drain) - b["S2"] * v
    right = inlet * root(supply - pd) - nozzle * curtain(b["xo"] + offset) * root(pd - drain) + b["S2"] * v
    swept = b["S2"] * z
    b.rate("Pg2", b["beta"] * left / volume(b["Vo2"], swept))
    b.rate("Pd2", b["beta"] * right / volume(b["Vo2"], -swept))


class ThreeStage(Valve):
    """Command [1] -> spool loop -> pilot current [A] -> pilot flows -> main spool -> main flows.

    Its own chambers are filled from the supply at all times, and so a liquid: of jack-10t none comes below 80 bar.
    """

    def flows(self, b: Assembly, command: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> ValveFlows:
        """The equations from command to flows; see Valve."""
        feed = b.magnitude("Ps")
        pg = b.state("Pg3", "Pa", feed, 0.5 * feed)
        pd = b.state("Pd3", "Pa", feed, 0.5 * feed)
        z = b.state("z3", "m", b.magnitude("z3max"))
        v = b.state("v3", "m/s", 0.5)
        current = _drive(b, command, z)
        pilot = pilot_stage(b, current, Lands(pg, pd, supply, drain), supply, drain)
        leak = b["Kf3"]
        swept = b["S3"] * z
        b.rate("Pg3", b["beta"] * (pilot.into_a + leak * root(supply - pg) - b["S3"] * v) / volume(b["Vo3"], swept))
        b.rate("Pd3", b["beta"] * (leak * root(supply - pd) - pilot.out_of_b + b["S3"] * v) / volume(b["Vo3"], -swept))
        openings = main_openings(b, z)
        ports = (lands.a, lands.b)
        friction = b.slot("main_friction", b["Fs3"] * ca.tanh(v / 5e-3), spool=z, velocity=v)
        force = b["S3"] * (pg - pd) - b["psi3"] * v - friction
        force -= flow_force(openings, b["rff3"] * b["K3"], ports, lands.supply, lands.drain)
        force -= spool_stop(z, v, b["z3over"] * b["z3max"], b["k3stop"], b["M3"])
        b.rate("z3", v)
        b.rate("v3", force / b["M3"])
        b.dry_friction("Fs3")
        lowest = ca.fmin(pilot.lowest, ca.fmin(pg, pd))
        return ValveFlows(*main_flows(b, openings, lands), lowest, {"current": current, "spool": z, **pilot.signals})

    def pilot(self, b: Assembly, lands: Lands, supply: ca.SX, drain: ca.SX) -> PilotFlows:
        """Stages 1 and 2 alone, their current [A] an input."""
        current = b.input("current", "A", b.magnitude("imax"))
        pilot = pilot_stage(b, current, lands, supply, drain)
        return replace(pilot, signals={"current": current, **pilot.signals})

    def saturation_limits(self, rig: Rig) -> Mapping[str, float]:
        """The current amplifier's limit [A]."""
        return {"current": rig["imax"] * rig["isat"]}

    def probe_points(self, rig: Rig) -> tuple[ProbePoint, ...]:
        """The measured current, the current that makes torque, and a force on the main spool."""
        current, force = 0.05 * rig["imax"], 0.1 * rig["S3"] * rig["Ps"]
        return (
            ProbePoint("drive", "current", "current", "A", current),
            ProbePoint("pilot", "motor_current", "current", "A", current),
            ProbePoint("main", "main_friction", "force", "N", force, against_motion=True),
        )


def _drive(b: Assembly, command: ca.SX, z: ca.SX) -> ca.SX:
    """Spool loop and current amplifier: normalised error -> pilot current [A]."""
    spool = z / b["z3max"]
    error = b.slot("command", command) - spool
    demand = b["Kp"] * error
    if "Td" in b:
        filtered = b.state("c1", "1", 1.0)
        b.rate("c1", (error - filtered) / b["tf"])
        demand += b["Kp"] * b["Td"] * (error - filtered) / b["tf"]
    if "Ti" in b:
        integral = b.state("c0", "1", 1.0)
        demand += integral
        excess = _saturate(demand, b["isat"]) - demand
        b.rate("c0", b["Kp"] * error / b["Ti"] + 400 * excess)
    demand = b.slot("corrector", demand, error=error, spool=spool, gain=b["Kp"], limit=b["isat"])
    return b.slot("current", b["imax"] * _saturate(demand, b["isat"]), limit=b["imax"] * b["isat"])


def _saturate(value: ca.SX, limit: ca.SX) -> ca.SX:
    return ca.fmax(ca.fmin(value, limit), -limit)
