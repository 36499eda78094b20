"""The rigid body of a platform and its legs: mass matrix, and the forces that are no jack's, as graphs.

Speeds are a twist (velocity of the platform's origin, angular velocity, along the base axes). A leg of two rigid
halves that does not turn about itself has the kinetic energy of a mass at its platform joint that is m along the leg
and mu(l) across it: m the rod's mass, mu = (J + m (l - a)^2)/l^2 with J that of the cylinder about the base joint and
of the rod about its centre, a from the platform joint (Lagrange's equations of the joint's three coordinates).
"""

from dataclasses import dataclass

import casadi as ca

from ..rigs.platform.kinematics import rotation_rows
from ..rigs.platform.platform import HALVES, leg_masses
from .assembly import Assembly


@dataclass(frozen=True)
class Pose:
    """Place of the origin from home [3] and its velocity, rotation [3, 3] to base axes, angular velocity [3]."""

    place: ca.SX
    velocity: ca.SX
    rotation: ca.SX
    turning: ca.SX


@dataclass(frozen=True)
class LegMotion:
    """One leg: its arm from the origin, direction and length, the velocity of its joint and the speed along the leg,
    and the mass that it is at its joint [3, 3] with the joint's acceleration (without that of the twist), inertia
    forces and weight there, [3] each."""

    arm: ca.SX
    along: ca.SX
    length: ca.SX
    velocity: ca.SX
    speed: ca.SX
    mass: ca.SX
    turned: ca.SX
    bias: ca.SX
    weight: ca.SX
    bent: ca.SX


def rotation_of(roll: ca.SX, pitch: ca.SX, yaw: ca.SX) -> ca.SX:
    """Rz(yaw) Ry(pitch) Rx(roll), as kinematics.rotation."""
    cosines, sines = ([of(angle) for angle in (roll, pitch, yaw)] for of in (ca.cos, ca.sin))
    return ca.vertcat(*(ca.horzcat(*row) for row in rotation_rows(cosines, sines)))


def angle_rates(pitch: ca.SX, yaw: ca.SX, turning: ca.SX) -> ca.SX:
    """Rates of roll, pitch and yaw [3], as kinematics.pose_rates."""
    cy, sy = ca.cos(yaw), ca.sin(yaw)
    level = cy * turning[0] + sy * turning[1]
    return ca.vertcat(level / ca.cos(pitch), cy * turning[1] - sy * turning[0], turning[2] + ca.tan(pitch) * level)


def leg_motion(b: Assembly, leg: str, pose: Pose, free: bool = False) -> LegMotion:
    """A leg of the numbers `leg`.name; one of a `free` rod, which its joint lets move, has no mass along itself."""
    arm = pose.rotation @ _vector(b, leg, "joint_x", "joint_y", "joint_z")
    vector = pose.place + arm - _vector(b, leg, "base_x", "base_y", "base_z")
    velocity = pose.velocity + ca.cross(pose.turning, arm)
    length = ca.sqrt(ca.sumsqr(vector))
    along = vector / length
    speed = ca.dot(along, velocity)
    across = velocity - speed * along
    squared = ca.sumsqr(across)
    rod = b[f"{leg}.rod_mass"]
    mu, slope, share = leg_masses({name: b[f"{leg}.{name}"] for name in HALVES}, length)
    turned = ca.cross(pose.turning, ca.cross(pose.turning, arm))
    axial = 0 if free else rod
    beside = 0 if free else (rod - mu) / length - slope / 2
    bias = slope * speed * across + beside * squared * along
    down = ca.vertcat(0, 0, -b["gravity"])
    weight = share * down + (axial - share) * ca.dot(along, down) * along
    mass = mu * ca.SX.eye(3) + (axial - mu) * (along @ along.T)
    return LegMotion(arm, along, length, velocity, speed, mass, turned, bias, weight, squared / length)


def payload_inertia(b: Assembly, pose: Pose) -> tuple[ca.SX, ca.SX]:
    """Mass matrix [6, 6] of the payload about the origin, and the wrench [6] of its weight less its inertia forces."""
    mass, centre = b["mass"], pose.rotation @ ca.vertcat(b["cx"], b["cy"], b["cz"])
    own = ca.vertcat(
        ca.horzcat(b["Ixx"], b["Ixy"], b["Ixz"]),
        ca.horzcat(b["Ixy"], b["Iyy"], b["Iyz"]),
        ca.horzcat(b["Ixz"], b["Iyz"], b["Izz"]),
    )
    inertia, cross = pose.rotation @ own @ pose.rotation.T, ca.skew(centre)
    matrix = ca.blockcat([[mass * ca.SX.eye(3), -mass * cross], [mass * cross, inertia - mass * cross @ cross]])
    w = pose.turning
    force = mass * (ca.vertcat(0, 0, -b["gravity"]) - ca.cross(w, ca.cross(w, centre)))
    return matrix, ca.vertcat(force, ca.cross(centre, force) - ca.cross(w, inertia @ w))


def leg_inertia(leg: LegMotion) -> tuple[ca.SX, ca.SX]:
    """Mass matrix [6, 6] of a leg about the origin, and the wrench [6] of its weight less its inertia forces."""
    cross = ca.skew(leg.arm)
    block = leg.mass @ cross
    matrix = ca.blockcat([[leg.mass, -block], [-block.T, -cross @ block]])
    force = leg.weight - leg.bias - leg.mass @ leg.turned
    return matrix, ca.vertcat(force, ca.cross(leg.arm, force))


def _vector(b: Assembly, leg: str, *names: str) -> ca.SX:
    return ca.vertcat(*(b[f"{leg}.{name}"] for name in names))
