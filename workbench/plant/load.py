"""What the jack moves: a mass, and a specimen whose far end may move."""

import casadi as ca

from .assembly import Assembly


def specimen_force(b: Assembly, x: ca.SX, v: ca.SX) -> ca.SX:
    """Load-cell force [N]: ks (x - xs) + cs (v - vs) + disturbance, with the far end and the disturbance as inputs."""
    far = b.input("specimen_position", "m", 0.25)
    far_speed = b.input("specimen_velocity", "m/s", 1.0)
    disturbance = b.input("disturbance", "N", 1e4)
    plain = b["ks"] * (x - far) + b["cs"] * (v - far_speed) + disturbance
    return b.slot("load", plain, position=x, velocity=v)


def cell_forces(b: Assembly, rod: ca.SX, force: ca.SX, acceleration: ca.SX) -> dict[str, ca.SX]:
    """What a load cell reads of a force [N] at the specimen: with it, what moves the mass between the two; on the rod
    the `rod` force [N] less what moves the mass before it, and so all that moves, lifts and loads the rest."""
    if "Mr" in b:
        return {"force": rod - b["Mr"] * acceleration, "reference_force": force}
    if "Mg" in b:
        return {"force": force + b["Mg"] * acceleration, "reference_force": force}
    return {"force": force}
