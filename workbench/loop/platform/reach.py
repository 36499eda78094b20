"""Where a platform can go, by its kinematics and statics: stroke, joint angles, forces, flow, singular poses."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...control.platform_controller import LEGS
from ...rigs.platform import AXES, Platform, leg_lengths, leg_speeds
from ...rigs.platform.kinematics import arms, condition, joint_angles, leg_vectors, rotation
from ...rigs.platform.platform import leg_masses
from ..capability import stall_force

_HALVINGS = 40
_FAR = np.array([2.0] * 3 + [1.2] * 3)  # m and rad: no platform that stands on its legs goes further
MOST_CONDITION = 20.0  # of the Jacobian: beyond it a leg force of one part in twenty decides an axis
PLANES = (("surge", "sway"), ("surge", "heave"), ("roll", "pitch"))


@dataclass(frozen=True)
class PoseCheck:
    """Poses [.., 6] against limits, each as a share of it, above 1 beyond: stroke, joint angles, static forces of the
    legs [.., 6], and the condition number of the Jacobian."""

    stroke: np.ndarray
    base_angle: np.ndarray
    platform_angle: np.ndarray
    force: np.ndarray
    condition: np.ndarray

    @property
    def allowed(self) -> np.ndarray:
        """Whether a pose keeps all limits, bool [..]."""
        shares = (self.stroke, self.base_angle, self.platform_angle, self.force)
        worst = np.maximum.reduce([share.max(axis=-1) for share in shares])
        return (worst <= 1.0) & (self.condition <= MOST_CONDITION)


def check_poses(platform: Platform, pose: np.ndarray) -> PoseCheck:
    """Poses [.., 6] of a platform at rest, against its limits."""
    geometry = platform.geometry
    base, joint = joint_angles(geometry, pose)
    travel = np.abs(leg_lengths(geometry, pose) - platform.middle)
    return PoseCheck(
        travel / platform.limits("stroke"),
        base / platform["base_angle"],
        joint / platform["platform_angle"],
        np.abs(static_forces(platform, pose)) / most_force(platform),
        condition(geometry, pose),
    )


def most_force(platform: Platform) -> np.ndarray:
    """What a jack may or can push [6], N, the less of the two."""
    stall = [min(stall_force(leg.rig, sign) for sign in (1.0, -1.0)) for leg in platform.legs]
    return np.minimum(stall, platform.limits("force"))


def static_forces(platform: Platform, pose: np.ndarray) -> np.ndarray:
    """Forces [.., 6] of the jacks, N, positive where they push, that hold platform and legs in poses [.., 6]."""
    geometry, g = platform.geometry, np.array([0.0, 0.0, -platform["gravity"]])
    joints, legs = arms(geometry, pose), leg_vectors(geometry, pose)
    length = np.linalg.norm(legs, axis=-1, keepdims=True)
    along = legs / length
    numbers = {name: values[:, None] for name, values in platform.leg_numbers.items()}
    share = leg_masses(numbers, length)[2]
    weight = share * g + (numbers["rod_mass"] - share) * (along @ g)[..., None] * along
    centre = rotation(pose) @ np.array([platform["cx"], platform["cy"], platform["cz"]])
    force = platform["mass"] * g + weight.sum(axis=-2)
    moment = np.cross(centre, platform["mass"] * g) + np.cross(joints, weight).sum(axis=-2)
    wrench = np.concatenate((force, moment), axis=-1)
    transposed = np.swapaxes(leg_speeds(geometry, pose), -1, -2)
    return -np.linalg.solve(transposed, wrench[..., None])[..., 0]


def largest_flow(platform: Platform, pose: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Largest flow [..] of a leg, m^3/s, at the speeds of a twist [6], each of the worse sign, in poses [.., 6]."""
    speeds = np.sum(np.abs(leg_speeds(platform.geometry, pose) * twist), axis=-1)
    return np.max(speeds * np.array([max(leg.rig.areas) for leg in platform.legs]), axis=-1)


def reach(platform: Platform) -> dict[str, tuple[float, float]]:
    """How far (m, rad) the platform goes along each axis alone, back and forth from home, within its limits."""
    axes = np.eye(LEGS)
    return {
        name: (-_furthest(platform, -axes[i] * _FAR[i]) * _FAR[i], _furthest(platform, axes[i] * _FAR[i]) * _FAR[i])
        for i, name in enumerate(AXES)
    }


def outline(platform: Platform, first: str, second: str, points: int = 72) -> tuple[np.ndarray, np.ndarray]:
    """The border (m, rad) [points + 1] of what is allowed in the plane of two axes through home."""
    i, j = AXES.index(first), AXES.index(second)
    turn = np.linspace(0, 2 * np.pi, points + 1)
    ways = np.zeros((points + 1, LEGS))
    ways[:, i], ways[:, j] = np.cos(turn) * _FAR[i], np.sin(turn) * _FAR[j]
    shares = np.array([_furthest(platform, way) for way in ways])
    return shares * ways[:, i], shares * ways[:, j]


def _furthest(platform: Platform, way: np.ndarray) -> float:
    """The share of a way [6] from home up to which every pose is allowed."""
    shares = np.linspace(0, 1, 201)
    allowed = check_poses(platform, shares[:, None] * way).allowed
    if allowed.all():
        return 1.0
    return _border(lambda share: bool(check_poses(platform, share * way).allowed), shares[int(np.argmin(allowed)) - 1])


def _border(allowed: Callable[[float], bool], low: float) -> float:
    high = low + 1 / 200
    if not allowed(low):
        return 0.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if allowed(middle) else (low, middle)
    return low


@dataclass(frozen=True)
class WorstPose:
    """The largest of a quantity over poses, its unit, and the pose [6] where it is."""

    name: str
    value: float
    unit: str
    pose: np.ndarray


def worst_poses(
    platform: Platform, box: np.ndarray, twist: np.ndarray, seed: int = 0, draws: int = 2000
) -> list[WorstPose]:
    """The worst over the corners of a box of +-`box` [6] about home and poses drawn inside it; flow at a twist [6] of
    either sign of every axis."""
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * LEGS)).reshape(LEGS, -1).T
    inside = np.random.default_rng(seed).uniform(-1, 1, (draws, LEGS))
    pose = np.concatenate((np.zeros((1, LEGS)), signs, inside)) * box
    check = check_poses(platform, pose)
    quantities = (
        ("stroke used", 100 * check.stroke.max(axis=-1), "%"),
        ("base joint angle used", 100 * check.base_angle.max(axis=-1), "%"),
        ("platform joint angle used", 100 * check.platform_angle.max(axis=-1), "%"),
        ("static leg force", 1e-3 * np.abs(static_forces(platform, pose)).max(axis=-1), "kN"),
        ("flow of a leg", 6e4 * largest_flow(platform, pose, twist), "l/min"),
        ("condition of the Jacobian", check.condition, "1"),
    )
    return [
        WorstPose(name, float(values.max()), unit, pose[int(np.argmax(values))]) for name, values, unit in quantities
    ]
