"""Friction and play of a platform's joints, and a payload that gives way, as graphs beside its rigid bodies."""

from dataclasses import dataclass

import casadi as ca

from ..rigs.platform.effects import FLEXIBLE, FRICTION, PLAY, TURNING
from .assembly import Assembly
from .platform_body import LegMotion, Pose

_TOUCH = 1e-6  # m: over which a joint with play touches
_AWAY = 1e-5  # m: beyond the play, where a search for equilibrium starts


@dataclass(frozen=True)
class FreeRod:
    """A rod that its joint lets move along the leg: how far it is beyond the joint and its speed, and the force with
    which it pushes the platform, N."""

    gap: ca.SX
    speed: ca.SX
    push: ca.SX


def joint_friction(b: Assembly, leg: str, motion: LegMotion, pose: Pose) -> ca.SX:
    """The wrench [6] about the origin of Coulomb friction in the two joints of a leg that does not turn about itself.

    M w / sqrt(w^2 + e^2) against the turning of the leg in its base joint and of the platform about the leg in the
    other one; the leg hands its moments on as a force across its end.
    """
    moment = b[f"{leg}.{FRICTION}.moment"]
    turning = ca.cross(motion.along, motion.velocity) / motion.length
    base, joint = _against(moment, turning), _against(moment, pose.turning - turning)
    force = ca.cross(base - joint, motion.along) / motion.length
    return ca.vertcat(force, ca.cross(motion.arm, force) + joint)


def _against(moment: ca.SX, turning: ca.SX) -> ca.SX:
    return -moment * turning / ca.sqrt(ca.sumsqr(turning) + TURNING**2)


def free_rod(b: Assembly, leg: str, motion: LegMotion) -> FreeRod:
    """The states of a rod with play in its joint on the platform: it starts as weight on the platform leaves it."""
    width, stiffness = b[f"{leg}.{PLAY}.width"], b[f"{leg}.{PLAY}.stiffness"]
    start = b.magnitude(f"{leg}.{PLAY}.width") / 2 + _AWAY
    gap = b.state(f"{leg}.gap", "m", 1e-3, start)
    speed = b.state(f"{leg}.rod_speed", "m/s", 1.0)
    damping = 2 * b[f"{leg}.{PLAY}.damping"] * ca.sqrt(stiffness * b[f"{leg}.rod_mass"])
    rate = speed - motion.speed
    b.rate(f"{leg}.gap", rate)
    pushed, touching = _beyond(gap - width / 2)
    pulled, held = _beyond(-gap - width / 2)
    return FreeRod(gap, speed, stiffness * (pushed - pulled) + damping * (touching + held) * rate)


def _beyond(x: ca.SX) -> tuple[ca.SX, ca.SX]:
    """max(x, 0), smooth, and its slope."""
    root = ca.sqrt(x**2 + _TOUCH**2)
    return (x + root) / 2, (1 + x / root) / 2


def move_rod(b: Assembly, leg: str, motion: LegMotion, rod: FreeRod, force: ca.SX) -> ca.SX:
    """The rate of a free rod's speed, under its jack's `force`: m v' = F - push - m (g cos - w^2 r), as in
    `workbench.identify.wrench.rod.rod_burden`. Returns it, m/s^2."""
    reach = motion.length - b[f"{leg}.rod_centre"]
    across = motion.velocity - motion.speed * motion.along
    turning = ca.sumsqr(across) / motion.length**2
    rate = (force - rod.push) / b[f"{leg}.rod_mass"] - b["gravity"] * motion.along[2] + turning * reach
    b.rate(f"{leg}.rod_speed", rate)
    return rate


def flexible_payload(b: Assembly, pose: Pose) -> tuple[ca.SX, ca.SX]:
    """A part of the payload as a point on springs alike along all axes: the mass matrix [6, 6] that it takes from the
    rigid payload, and the wrench [6] about the origin of its weight and springs, less what it takes of the payload's
    weight and inertia forces. It is measured from where its weight leaves it at home."""
    mass, damping = b[f"{FLEXIBLE}.mass"], b[f"{FLEXIBLE}.damping"]
    turns = 2 * ca.pi * b[f"{FLEXIBLE}.frequency"]
    arm = pose.rotation @ ca.vertcat(b["cx"], b["cy"], b[f"{FLEXIBLE}.height"])
    names = [(f"flexible_{axis}", f"flexible_speed_{axis}") for axis in "xyz"]
    bent = ca.vertcat(*(b.state(place, "m", 1e-2) for place, _ in names))
    speed = ca.vertcat(*(b.state(rate, "m/s", 1.0) for _, rate in names))
    rate = speed - pose.velocity - ca.cross(pose.turning, arm)
    spring = mass * (turns**2 * bent + 2 * damping * turns * rate)
    for i, (place, own) in enumerate(names):
        b.rate(place, rate[i])
        b.rate(own, -spring[i] / mass)
    cross = ca.skew(arm)
    matrix = mass * ca.blockcat([[ca.SX.eye(3), -cross], [cross, -cross @ cross]])
    force = spring + mass * ca.cross(pose.turning, ca.cross(pose.turning, arm))
    return -matrix, ca.vertcat(force, ca.cross(arm, force))
