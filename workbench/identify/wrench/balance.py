"""The wrench that a platform's legs give its payload, beside what the motion of the payload asks for.

Newton's and Euler's equations about the platform's origin are linear in the mass, the mass times the centre, and the
inertia about the origin (Atkeson, An and Hollerbach, Estimation of inertial parameters of manipulator loads and links,
Int. J. Robotics Research 5(3), 1986).
"""

from dataclasses import dataclass

import numpy as np

from ...rigs.platform import Platform, leg_speeds
from ...rigs.platform.kinematics import arms, leg_vectors, rotation
from ...rigs.platform.platform import leg_masses
from .motion import LegSignals, PoseTrajectory, motion

NUMBERS = ("mass", "cx", "cy", "cz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of the moments of inertia in their matrix


@dataclass(frozen=True, eq=False)
class WrenchBalance:
    """Along the platform's axes: the `wrench` [n, 6] that the legs give the payload, without its weight, N and N m, and
    what a unit of each linear number asks for, `columns` [n, 6, 10]; `moved` is the motion."""

    moved: PoseTrajectory
    wrench: np.ndarray
    columns: np.ndarray

    def left(self, linear: np.ndarray) -> np.ndarray:
        """The wrench [n, 6] that a payload of linear numbers [10] does not ask for."""
        return self.wrench - self.columns @ linear


def balance(platform: Platform, legs: LegSignals, near: np.ndarray | None = None) -> WrenchBalance:
    """The balance of a motion `near` poses [n, 6] (home). Raises InputError where no pose has the measured lengths."""
    moved = motion(platform, legs, near)
    wrench = np.einsum("nij,ni->nj", leg_speeds(platform.geometry, moved.pose), legs.force) + _across(platform, moved)
    falling = moved.rate[:, :3] + (0.0, 0.0, platform["gravity"])
    parts = (falling, moved.twist[:, 3:], moved.rate[:, 3:])
    return WrenchBalance(
        moved, in_platform(moved.pose, wrench), _columns(*(in_platform(moved.pose, each) for each in parts))
    )


def in_platform(pose: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors [n, 3], or wrenches [n, 6], along the axes of base in those of platform."""
    parts = vectors.reshape(len(vectors), -1, 3)
    return np.einsum("nji,nkj->nki", rotation(pose), parts).reshape(vectors.shape)


def linear_numbers(values: np.ndarray) -> np.ndarray:
    """Mass, mass times centre, and inertia about the origin [10] of the numbers of a payload [10], by NUMBERS."""
    mass, centre = values[0], values[1:4]
    return np.concatenate(([mass], mass * centre, values[4:] + _about(mass, centre)))


def payload_numbers(linear: np.ndarray) -> np.ndarray:
    """Back from `linear_numbers`."""
    mass, centre = linear[0], linear[1:4] / linear[0]
    return np.concatenate(([mass], centre, linear[4:] - _about(mass, centre)))


def _about(mass: float, centre: np.ndarray) -> np.ndarray:
    matrix = mass * (np.eye(3) * (centre @ centre) - np.outer(centre, centre))
    return np.array([matrix[place] for place in PLACES])


def _columns(a: np.ndarray, w: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Force and moment [n, 6, 10] that a unit of mass, mass times centre and inertia asks for."""
    columns = np.zeros((len(a), 6, len(NUMBERS)))
    columns[:, :3, 0] = a
    columns[:, :3, 1:4] = _cross(alpha) + _cross(w) @ _cross(w)
    columns[:, 3:, 1:4] = -_cross(a)
    columns[:, 3:, 4:] = _turning(alpha) + _cross(w) @ _turning(w)
    return columns


def _cross(vectors: np.ndarray) -> np.ndarray:
    """Matrices [n, 3, 3] of the vector product with vectors [n, 3]."""
    x, y, z = vectors.T
    none = np.zeros_like(x)
    rows = ((none, -z, y), (z, none, -x), (-y, x, none))
    return np.stack([np.stack(row, -1) for row in rows], -2)


def _turning(vectors: np.ndarray) -> np.ndarray:
    """From the six moments of inertia to the inertia times vectors [n, 3, 6]."""
    matrix = np.zeros((len(vectors), 3, len(PLACES)))
    for column, (i, j) in enumerate(PLACES):
        matrix[:, i, column] += vectors[:, j]
        if i != j:
            matrix[:, j, column] += vectors[:, i]
    return matrix


def _across(platform: Platform, moved: PoseTrajectory) -> np.ndarray:
    """The wrench [n, 6] of weight less inertia of the legs across themselves, which no load cell measures; see
    `workbench.plant.platform_body`."""
    pose, twist, turned = moved.pose, moved.twist, moved.rate
    arm, legs = arms(platform.geometry, pose), leg_vectors(platform.geometry, pose)
    length = np.linalg.norm(legs, axis=-1, keepdims=True)
    along = legs / length
    w = twist[:, None, 3:]
    velocity = twist[:, None, :3] + np.cross(w, arm)
    acceleration = turned[:, None, :3] + np.cross(turned[:, None, 3:], arm) + np.cross(w, np.cross(w, arm))
    speed = np.sum(along * velocity, axis=-1, keepdims=True)
    own = {name: values[:, None] for name, values in platform.leg_numbers.items()}
    mu, slope, share = leg_masses(own, length)
    down = np.array([0.0, 0.0, -platform["gravity"]])
    force = share * down - slope * speed * velocity - mu * acceleration
    force = force - np.sum(along * force, axis=-1, keepdims=True) * along
    return np.concatenate((force.sum(axis=1), np.cross(arm, force).sum(axis=1)), axis=-1)
