"""Mass, centre and inertia of a platform's payload, from the forces and positions that its legs measured.

Newton's and Euler's equations about the platform's origin are linear in the mass, the mass times the centre, and the
inertia about the origin (Atkeson, An and Hollerbach, Estimation of inertial parameters of manipulator loads and links,
Int. J. Robotics Research 5(3), 1986). Positions and forces go through one filter, so that neither comes late.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...records import Record
from ...rigs.platform import AXES, Platform, leg_speeds, pose_rates
from ...rigs.platform.kinematics import arms, leg_vectors, rotation

NUMBERS = ("mass", "cx", "cy", "cz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
PASSES, ORDER = 25.0, 4  # Hz below which the filter passes, and its order
ENDS = 0.2  # s at both ends of a record, which a filter bends
ROUNDS = 3  # of weights
_PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of the moments of inertia in their matrix


@dataclass(frozen=True, eq=False)
class PayloadFit:
    """`values` and 95 % half widths [10], SI, by NUMBERS; the RMS [6] of the wrench about the origin, N and N m, that
    the payload asked for and that is left."""

    values: np.ndarray
    halves: np.ndarray
    wrench: np.ndarray
    left: np.ndarray


def fit_payload(platform: Platform, records: Sequence[Sequence[Record]]) -> PayloadFit:
    """By least squares over records, each as its six legs, every component weighed by what is left of it. Raises
    InputError for no record."""
    if not records:
        raise InputError(f"platform {platform.name}: no train record to fit its payload to; list some under [records]")
    parts = [_equations(platform, legs) for legs in records]
    columns, wrench = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    solved, left, covariance = _solved(columns, wrench, np.ones(len(AXES)))
    for _ in range(ROUNDS):
        solved, left, covariance = _solved(columns, wrench, 1 / np.sqrt(np.mean(left**2, axis=0)))
    values, slopes = _numbers(solved)
    halves = 1.96 * np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes))
    return PayloadFit(values, halves, *(np.sqrt(np.mean(each**2, axis=0)) for each in (wrench, left)))


def _solved(columns: np.ndarray, wrench: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The ten linear numbers, the wrench [n, 6] that is left, and their covariance."""
    matrix, right = (columns * weights[:, None]).reshape(-1, columns.shape[-1]), (wrench * weights).ravel()
    solved = np.linalg.lstsq(matrix, right, rcond=None)[0]
    left = wrench - columns @ solved
    variance = float(np.mean((left * weights) ** 2))
    return solved, left, variance * np.linalg.inv(matrix.T @ matrix)


def _numbers(solved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mass, centre and inertia about it [10] of the linear numbers [10], and their slopes by these [10, 10]."""

    def of(linear: np.ndarray) -> np.ndarray:
        mass, centre = linear[0], linear[1:4] / linear[0]
        about = np.array([[1.0 if i == j else 0.0 for j in range(3)] for i in range(3)]) * (centre @ centre)
        about = mass * (about - np.outer(centre, centre))
        own = linear[4:] - [about[place] for place in _PLACES]
        return np.concatenate(([mass], centre, own))

    steps = 1e-6 * np.maximum(np.abs(solved), 1.0)
    slopes = [(of(solved + step) - of(solved - step)) / (2 * step.sum()) for step in np.diag(steps)]
    return of(solved), np.column_stack(slopes)


def _equations(platform: Platform, legs: Sequence[Record]) -> tuple[np.ndarray, np.ndarray]:
    """Of one record what each linear number asks for [n, 6, 10], and the wrench [n, 6] on the payload without its
    weight, along the platform's axes; rows as far apart as the filter keeps them independent."""
    from scipy.signal import butter, sosfiltfilt

    t, period = legs[0].t, legs[0].period
    low = butter(ORDER, PASSES, fs=1 / period, output="sos")
    positions, forces = (
        sosfiltfilt(low, np.column_stack([leg.signals[name] for leg in legs]), axis=0) for name in ("position", "force")
    )
    pose = platform.poses(positions)
    rates = np.gradient(pose, t, axis=0, edge_order=2)
    twist = np.linalg.solve(pose_rates(pose), rates[..., None])[..., 0]
    turned = np.gradient(twist, t, axis=0, edge_order=2)
    wrench = np.einsum("nij,ni->nj", leg_speeds(platform.geometry, pose), forces)
    wrench = wrench + _across(platform, pose, twist, turned)
    back = np.swapaxes(rotation(pose), -1, -2)
    falling = turned[:, :3] + (0.0, 0.0, platform["gravity"])
    a, w, alpha, force, moment = (
        np.einsum("nij,nj->ni", back, each)
        for each in (falling, twist[:, 3:], turned[:, 3:], wrench[:, :3], wrench[:, 3:])
    )
    edge, stride = round(ENDS / period), max(1, round(0.5 / (PASSES * period)))
    rows = slice(edge, len(t) - edge, stride)
    return _columns(a[rows], w[rows], alpha[rows]), np.hstack((force, moment))[rows]


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
    matrix = np.zeros((len(vectors), 3, len(_PLACES)))
    for column, (i, j) in enumerate(_PLACES):
        matrix[:, i, column] += vectors[:, j]
        if i != j:
            matrix[:, j, column] += vectors[:, i]
    return matrix


def _across(platform: Platform, pose: np.ndarray, twist: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """The wrench [n, 6] of weight less inertia of the legs across themselves, which no load cell measures; see
    `workbench.plant.platform_body`."""
    arm, legs = arms(platform.geometry, pose), leg_vectors(platform.geometry, pose)
    length = np.linalg.norm(legs, axis=-1, keepdims=True)
    along = legs / length
    w = twist[:, None, 3:]
    velocity = twist[:, None, :3] + np.cross(w, arm)
    acceleration = turned[:, None, :3] + np.cross(turned[:, None, 3:], arm) + np.cross(w, np.cross(w, arm))
    speed = np.sum(along * velocity, axis=-1, keepdims=True)
    own = {
        name: np.array([leg.numbers[name].value for leg in platform.legs])[:, None] for name in platform.legs[0].numbers
    }
    reach = length - own["rod_centre"]
    turning = own["cylinder_inertia"] + own["cylinder_mass"] * own["cylinder_centre"] ** 2 + own["rod_inertia"]
    mu = (turning + own["rod_mass"] * reach**2) / length**2
    slope = 2 * (own["rod_mass"] * reach / length - mu) / length
    share = (own["cylinder_mass"] * own["cylinder_centre"] + own["rod_mass"] * reach) / length
    down = np.array([0.0, 0.0, -platform["gravity"]])
    force = share * down - slope * speed * velocity - mu * acceleration
    force = force - np.sum(along * force, axis=-1, keepdims=True) * along
    return np.concatenate((force.sum(axis=1), np.cross(arm, force).sum(axis=1)), axis=-1)
