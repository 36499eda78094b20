"""A leg of a platform, cut out of it: a jack of its rod's mass under the force that the load cell on its rod measured.

Nothing of the platform, its payload or the other legs is in that: what they do to the leg is in the measured force.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...records import Campaign, InputNoise, Record, load_campaign
from ...records.campaign import ROLES
from ...rigs.platform import Platform
from ...rigs.platform.kinematics import leg_vectors
from ...rigs.rig import Rig
from .white_part import white_part

_TAKEN = ("force", "acceleration")  # the first is an input; a rod as light as that shakes by the noise of the first
_HELD = (0.5, 0.5)  # of the force in a row and in the next
NEEDED = ("force", "position", "pa", "pb")


def leg_rig(platform: Platform, leg: int) -> Rig:
    """The rig of a leg, counted from 0, with the mass of its rod alone and without the sensors that the cut takes."""
    own = platform.legs[leg]
    rig = own.rig.with_values(M=own.numbers["rod_mass"].value)
    return replace(rig, sensors={name: sensor for name, sensor in rig.sensors.items() if name not in _TAKEN})


def leg_campaign(folder: str | Path, platform: Platform, leg: int) -> Campaign:
    """The records of a leg, counted from 0, as those of a jack. Raises InputError where a signal that the cut needs is
    missing."""
    campaign, weight = load_campaign(folder, leg + 1), _rod_weight(platform, leg)
    for record in campaign.records:
        for name in NEEDED:
            if name not in record.signals:
                where = f"{campaign.path}: record {record.name}: no column leg{leg + 1}.{name}"
                raise InputError(f"{where}; a leg is cut out of its platform by it: record it")
    roles = {role: tuple(_cut(record, weight) for record in getattr(campaign, role)) for role in ROLES}
    noise = InputNoise(white_part("force", campaign.records).sigma, _HELD)  # at rest the platform still rings in it
    return replace(campaign, **roles, input_noise={"disturbance": noise})


def _rod_weight(platform: Platform, leg: int) -> float:
    """Weight [N] of the rod along the leg at home. It changes by a twentieth over the stroke, and the rod's centripetal
    force is as small: both are below the noise of a load cell."""
    vector = leg_vectors(platform.geometry, np.zeros(6))[leg]
    return float(
        platform.legs[leg].numbers["rod_mass"].value * platform["gravity"] * vector[2] / np.linalg.norm(vector)
    )


def _cut(record: Record, weight: float) -> Record:
    """The force becomes an input that is held from row to row: the mean of both rows, or it would come half a period
    late."""
    force, (now, after) = record.signals["force"], _HELD
    load = now * force + after * np.append(force[1:], force[-1]) + weight
    kept = {name: values for name, values in record.signals.items() if name not in _TAKEN}
    valid = {name: record.valid[name] for name in kept}
    return replace(record, signals={**kept, "disturbance": load}, valid=valid, notes=())
