"""Stages 1 and 2: torque motor, double nozzle-flapper, pilot spool with feedback spring (paper, section 2)."""

import casadi as ca

from ..assembly import Assembly
from ..orifice import curtain, exponential_lap, flow_force, land_flows, root, spool_stop, volume
from .lands import Lands, PilotFlows


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
