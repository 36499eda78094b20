"""The forces of a platform's rods where no load cell measured them: what the motion of the payload asks of each leg.

The payload's numbers are those that close the balance of the wrench with the forces of the pressures, which leave out
dry friction alone. The force on a leg then needs no pressure: the payload's motion says it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...records import Campaign, Record
from ...records.campaign import ROLES
from ...rigs.platform import LEGS, Platform, leg_speeds
from ...rigs.platform.kinematics import rotation
from ..data.white_part import white_part
from .balance import balance, linear_numbers
from .fitted import fit_payload, together, wrench_problem
from .motion import ORDER, LegSignals, leg_signals, passed, slope
from .rod import rod_burden, rod_masses

SLOW = 40.0  # Hz: below which positions tell how the payload accelerates
_TAPS = 128  # to either side: of the noise's response


@dataclass(frozen=True, eq=False)
class LegForces:
    """By role and record the forces [n, 6] against which the `masses` [6] of legs move, N; and their noise: its
    standard deviation [6] were it white, and the weights [taps] of rows that follow one another."""

    forces: dict[str, list[np.ndarray]]
    sigma: np.ndarray
    weights: tuple[float, ...]
    masses: np.ndarray


def with_pressure_forces(platform: Platform, whole: Sequence[Campaign]) -> list[Campaign]:
    """The records of each leg [6] with a force: that of its pressures less what its rod's motion takes of it. Dry
    friction of the jack is left in."""
    roles = {role: together(whole, role) for role in ROLES}
    found = {role: [_pressure_forces(platform, legs) for legs in records] for role, records in roles.items()}
    return [
        replace(campaign, **{role: tuple(record[leg] for record in found[role]) for role in ROLES})
        for leg, campaign in enumerate(whole)
    ]


def _pressure_forces(platform: Platform, legs: Sequence[Record]) -> list[Record]:
    period = legs[0].period
    position = passed(np.column_stack([record.signals["position"] for record in legs]), period, SLOW)
    speed = slope(position, period)
    taken = rod_burden(platform, legs[0].t, platform.poses(position))
    records = []
    for i, (record, leg) in enumerate(zip(legs, platform.legs, strict=True)):
        area_a, area_b = leg.rig.areas
        inertia = leg.numbers["rod_mass"].value * slope(speed[:, i], period)
        force = area_a * record.signals["pa"] - area_b * record.signals["pb"]
        force = force - leg.rig["b"] * speed[:, i] - inertia - taken[:, i]
        valid = record.valid["position"]
        signals = {**record.signals, "force": force}
        records.append(replace(record, signals=signals, valid={**record.valid, "force": valid}))
    return records


def payload_forces(platform: Platform, whole: Sequence[Campaign]) -> LegForces:
    """By the motion of the payload in the records of each leg [6], which have the forces of pressures.

    The mass that a leg alone moves stays with the leg: what its own acceleration asks for would come back as noise.
    """
    payload = linear_numbers(fit_payload(wrench_problem(platform, whole)).values)
    masses = _carried(platform, payload)
    read = {role: [leg_signals(legs, SLOW, np.inf) for legs in together(whole, role)] for role in ROLES}
    own = np.diag(masses) - rod_masses(platform)

    def against(legs: LegSignals) -> np.ndarray:
        return _asked(platform, legs, payload) - own * legs.acceleration

    forces = {role: [against(legs) for legs in every] for role, every in read.items()}
    size, weights = _noise([campaign.records for campaign in whole])
    return LegForces(forces, size * np.linalg.norm(masses - np.diag(own), axis=1), weights, np.diag(masses))


def _asked(platform: Platform, legs: LegSignals, payload: np.ndarray) -> np.ndarray:
    """The forces [n, 6] of rods that the payload's motion asks for."""
    free = balance(platform, replace(legs, force=np.zeros_like(legs.force)))
    pose = free.moved.pose
    parts = (-free.left(payload)).reshape(-1, 2, 3)
    wrench = np.einsum("nij,nkj->nki", rotation(pose), parts).reshape(-1, LEGS)
    transposed = np.swapaxes(leg_speeds(platform.geometry, pose), 1, 2)
    return np.linalg.solve(transposed, wrench[..., None])[..., 0]


def _noise(records: Sequence[Sequence[Record]]) -> tuple[float, tuple[float, ...]]:
    """Noise of the accelerations of legs, by positions through the filter of `leg_signals`: the standard deviation of
    white noise, and the weights that give it the power that it has at each frequency."""
    f = np.fft.rfftfreq(2 * _TAPS, records[0][0].period)
    sigma = float(np.sqrt(np.mean([white_part("position", leg).sigma ** 2 for leg in records])))
    passes = 1 / (1 + (f / SLOW) ** (2 * ORDER))  # of a Butterworth filter there and back
    weights = np.roll(np.fft.irfft(sigma * (2 * np.pi * f) ** 2 * passes), _TAPS)
    size = float(np.sqrt(np.sum(weights**2)))
    return size, tuple((weights / size).tolist())


def _carried(platform: Platform, payload: np.ndarray) -> np.ndarray:
    """The forces [6, 6] of rods at home, N, per acceleration of each leg, m/s^2."""
    rest = np.zeros((LEGS, LEGS))
    still = LegSignals(np.arange(LEGS) * 1e-3, platform.positions(rest), rest, rest)
    pushed = replace(still, acceleration=np.eye(LEGS))
    return (_asked(platform, pushed, payload) - _asked(platform, still, payload)).T + np.diag(rod_masses(platform))
