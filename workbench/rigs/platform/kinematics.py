"""Kinematics of a platform on six legs, in numpy alone.

A pose [.., 6] is surge, sway, heave [m] of the platform's origin from its place at home, and roll, pitch, yaw [rad]:
the rotation Rz(yaw) Ry(pitch) Rx(roll) from platform to base, singular at a pitch of +-90 degrees only, where no leg
reaches. A twist [.., 6] is the velocity of the origin [m/s] and the angular velocity [rad/s], both along the base axes.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.errors import InputError

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
_STEPS = 30
_CLOSED = 1e-12  # of the leg's length: how near forward kinematics comes


@dataclass(frozen=True, eq=False)
class Geometry:
    """Joints on the base [6, 3], in its frame, and on the platform [6, 3], in its own, all m; `height` [m] of the
    platform's origin above the base frame at home."""

    base: np.ndarray
    joints: np.ndarray
    height: float

    @property
    def weights(self) -> np.ndarray:
        """Metres [6] that a unit of each axis of a pose moves the platform's joints."""
        return np.array([1.0] * 3 + [self.radius] * 3)

    @property
    def radius(self) -> float:
        """Mean distance [m] of the platform's joints from its origin: the length by which angles are weighed."""
        return float(np.mean(np.linalg.norm(self.joints, axis=1)))


def rotation(pose: np.ndarray) -> np.ndarray:
    """Rotation matrices [.., 3, 3] from platform to base axes."""
    cosines, sines = (np.moveaxis(of(pose[..., 3:]), -1, 0) for of in (np.cos, np.sin))
    return np.stack([np.stack(row, -1) for row in rotation_rows(cosines, sines)], -2)


def rotation_rows(cosines: Iterable[Any], sines: Iterable[Any]) -> tuple[tuple[Any, ...], ...]:
    """Rz(yaw) Ry(pitch) Rx(roll), row by row, of cosines and sines of roll, pitch and yaw: numbers or symbols."""
    (cr, cp, cy), (sr, sp, sy) = cosines, sines
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def arms(geometry: Geometry, pose: np.ndarray) -> np.ndarray:
    """The platform's joints from its origin, along the base axes [.., 6, 3], m."""
    return geometry.joints @ np.swapaxes(rotation(pose), -1, -2)


def leg_vectors(geometry: Geometry, pose: np.ndarray) -> np.ndarray:
    """Legs from base joint to platform joint [.., 6, 3], m."""
    origin = pose[..., None, :3] + (0.0, 0.0, geometry.height)
    return origin + arms(geometry, pose) - geometry.base


def leg_lengths(geometry: Geometry, pose: np.ndarray) -> np.ndarray:
    """Inverse kinematics, exact: lengths [.., 6] of the legs, m."""
    return np.linalg.norm(leg_vectors(geometry, pose), axis=-1)


def leg_speeds(geometry: Geometry, pose: np.ndarray) -> np.ndarray:
    """The Jacobian [.., 6, 6] from a twist to the speeds of the legs; its transpose takes leg forces to a wrench."""
    legs = leg_vectors(geometry, pose)
    along = legs / np.linalg.norm(legs, axis=-1, keepdims=True)
    return np.concatenate((along, np.cross(arms(geometry, pose), along)), axis=-1)


def pose_rates(pose: np.ndarray) -> np.ndarray:
    """[.., 6, 6] from a twist to the rates of the pose; singular at a pitch of +-90 degrees."""
    cy, sy = np.cos(pose[..., 5]), np.sin(pose[..., 5])
    cp, tp = np.cos(pose[..., 4]), np.tan(pose[..., 4])
    zero, one = np.zeros_like(cy), np.ones_like(cy)
    turn = np.stack(
        [np.stack(row, -1) for row in ((cy / cp, sy / cp, zero), (-sy, cy, zero), (cy * tp, sy * tp, one))], -2
    )
    rates = np.zeros((*pose.shape, 6))
    rates[..., :3, :3], rates[..., 3:, 3:] = np.eye(3), turn
    return rates


def forward(geometry: Geometry, lengths: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """The poses [.., 6] with these leg lengths [.., 6], by Newton's method from the pose `start` (home).

    Six lengths belong to up to forty poses; this is the one that steps from `start` lead to, so start near. Raises
    InputError where they lead nowhere: lengths that no pose has, or a start beyond a singular pose.
    """
    pose = np.zeros(lengths.shape) if start is None else np.broadcast_to(start, lengths.shape).astype(float)
    for _ in range(_STEPS):
        short = lengths - leg_lengths(geometry, pose)
        if np.abs(short).max() <= _CLOSED * np.max(lengths):
            return pose
        slopes = leg_speeds(geometry, pose) @ np.linalg.inv(pose_rates(pose))
        if not np.all(np.isfinite(slopes)) or np.max(np.linalg.cond(slopes, 1)) > 1e12:
            break
        pose = pose + np.linalg.solve(slopes, short[..., None])[..., 0]
    raise InputError("no pose with these leg lengths near the one that the search starts at; start nearer")


def condition(geometry: Geometry, pose: np.ndarray) -> np.ndarray:
    """Condition numbers [..] of the Jacobian, angles weighed by the radius: infinite at a singular pose, where legs
    cannot hold the platform."""
    return np.linalg.cond(leg_speeds(geometry, pose) / geometry.weights)


def joint_angles(geometry: Geometry, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles [.., 6], rad, of the legs from their directions at home, as the base joints and the platform joints see
    them: universal joints stand in the middle of their range at home."""
    home, legs = leg_vectors(geometry, np.zeros(6)), leg_vectors(geometry, pose)
    return _angle(home, legs), _angle(home, legs @ rotation(pose))


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    across = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.arctan2(across, np.sum(a * b, axis=-1))
