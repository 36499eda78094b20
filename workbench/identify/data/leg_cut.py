"""A leg of a platform, cut out of it: a jack of its rod's mass under the force that the load cell on its rod measured.

Nothing of the platform, its payload or the other legs is in that: what they do to the leg is in the measured force.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...records import Campaign, InputNoise, Record, load_campaign
from ...records.campaign import ROLES, judged_by
from ...rigs.platform import LEGS, Platform
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


def whole_campaigns(folder: str | Path, heldout: Sequence[str] = ()) -> list[Campaign]:
    """The records of each leg as they were measured; `heldout` names those to hold out instead of the campaign's."""
    campaigns = [load_campaign(folder, leg + 1) for leg in range(LEGS)]
    return [judged_by(campaign, heldout) for campaign in campaigns] if heldout else campaigns


def leg_campaigns(folder: str | Path, platform: Platform) -> list[Campaign]:
    """The records of each leg as those of a jack. Raises InputError where a signal that the cut needs is missing."""
    whole = whole_campaigns(folder)
    for leg, campaign in enumerate(whole, 1):
        for record in campaign.records:
            for name in NEEDED:
                if name not in record.signals:
                    where = f"{campaign.path}: record {record.name}: no column leg{leg}.{name}"
                    raise InputError(f"{where}; a leg is cut out of its platform by it: record it")
    cut = {role: [cut_legs(platform, legs) for legs in _together(whole, role)] for role in ROLES}
    return [
        _as_jack(campaign, {role: tuple(legs[leg] for legs in records) for role, records in cut.items()})
        for leg, campaign in enumerate(whole)
    ]


def cut_legs(platform: Platform, legs: Sequence[Record]) -> list[Record]:
    """One record of a platform, its six legs, as six records of jacks."""
    positions = np.column_stack([record.signals["position"] for record in legs])
    burden = rod_burden(platform, legs[0].t, platform.poses(positions))
    return [_cut(record, burden[:, leg]) for leg, record in enumerate(legs)]


def _together(whole: Sequence[Campaign], role: str) -> list[tuple[Record, ...]]:
    """The records of a role, each as its six legs."""
    return list(zip(*(getattr(campaign, role) for campaign in whole), strict=True))


def _as_jack(campaign: Campaign, roles: Mapping[str, tuple[Record, ...]]) -> Campaign:
    """The campaign of one leg with its cut records by role; the noise of its load cell is that of an input."""
    noise = InputNoise(white_part("force", campaign.records).sigma, _HELD)  # at rest the platform still rings in it
    return replace(campaign, **roles, input_noise={"disturbance": noise})


def _cut(record: Record, burden: np.ndarray) -> Record:
    """The force becomes an input that is held from row to row: the mean of both rows, or it would come half a period
    late."""
    force, (now, after) = record.signals["force"] + burden, _HELD
    load = now * force + after * np.append(force[1:], force[-1])
    kept = {name: values for name, values in record.signals.items() if name not in _TAKEN}
    valid = {name: record.valid[name] for name in kept}
    return replace(record, signals={**kept, "disturbance": load}, valid=valid, notes=())


def rod_burden(platform: Platform, t: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """What a rod bears beside its load cell's force and the inertia along its leg, [n, 6] N, at times t [n] in poses
    [n, 6]: m (g cos - w^2 r), its weight along the leg less the centripetal force of its centre, r from the base joint.

    Both follow from the energy of `workbench.plant.platform_body`. They change by some 50 N over a stroke, which moves
    a jack that nothing holds by 0.1 mm in some seconds.
    """
    vectors = leg_vectors(platform.geometry, poses)
    lengths = np.linalg.norm(vectors, axis=-1)
    along = vectors / lengths[..., None]
    turning = np.sum(np.gradient(along, t, axis=0) ** 2, axis=-1)
    mass, centre = (np.array([leg.numbers[name].value for leg in platform.legs]) for name in ("rod_mass", "rod_centre"))
    return mass * (platform["gravity"] * along[..., 2] - turning * (lengths - centre))
