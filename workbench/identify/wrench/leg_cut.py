"""A leg of a platform, cut out of it: a jack of its rod's mass under the force that the load cell on its rod measured.

Nothing of the platform, its payload or the other legs is in that: what they do to the leg is in the measured force.
Where legs have no load cells, the payload's motion says their forces.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...records import Campaign, InputNoise, Record, load_campaign
from ...records.campaign import ROLES, judged_by
from ...rigs.platform import LEGS, Platform
from ...rigs.rig import Rig
from ..data.white_part import white_part
from .fitted import WrenchProblem, together, wrench_problem
from .leg_forces import LegForces, payload_forces, with_pressure_forces
from .rod import rod_burden, rod_masses

CELL, NEEDED = "force", ("position", "pa", "pb")
_TAKEN = (CELL, "acceleration")  # the first is an input; a rod as light as that shakes by the noise of the first
_HELD = (0.5, 0.5)  # of the force in a row and in the next


@dataclass(frozen=True, eq=False)
class CutLeg:
    """A leg as a jack: its records, and its rig with the mass that moves under the force in them, without the sensors
    that the cut takes."""

    campaign: Campaign
    rig: Rig


def whole_campaigns(folder: str | Path, heldout: Sequence[str] = ()) -> list[Campaign]:
    """The records of each leg as they were measured; `heldout` names those to hold out instead of the campaign's."""
    campaigns = [load_campaign(folder, leg + 1) for leg in range(LEGS)]
    return [judged_by(campaign, heldout) for campaign in campaigns] if heldout else campaigns


def cut_records(platform: Platform, legs: Sequence[Record]) -> list[Record]:
    """One record of a platform, its six legs with the forces of their load cells, as six records of jacks."""
    force = np.column_stack([record.signals[CELL] for record in legs]) + _burden(platform, legs)
    return [_cut(record, force[:, leg]) for leg, record in enumerate(legs)]


def has_load_cells(whole: Sequence[Campaign]) -> bool:
    """Whether every leg's force was measured in every record."""
    return all(CELL in record.signals for campaign in whole for record in campaign.records)


def payload_problem(platform: Platform, whole: Sequence[Campaign]) -> WrenchProblem:
    """The balance of the payload by load cells; by pressures where there are none: these leave out the dry friction of
    jacks, so that the payload's numbers can be fitted and joints are not judged. Raises InputError as
    `cut_legs`."""
    _check(whole)
    if not whole[0].train:
        raise InputError(f"{whole[0].path}: no train record to fit the payload to; list some under [records]")
    if has_load_cells(whole):
        return wrench_problem(platform, whole)
    return wrench_problem(platform, with_pressure_forces(platform, whole), judging=False)


def _check(whole: Sequence[Campaign]) -> None:
    for leg, campaign in enumerate(whole, 1):
        for record in campaign.records:
            for name in NEEDED:
                if name not in record.signals:
                    where = f"{campaign.path}: record {record.name}: no column leg{leg}.{name}"
                    raise InputError(f"{where}; a leg is cut out of its platform by it: record it")


def cut_legs(platform: Platform, whole: Sequence[Campaign]) -> list[CutLeg]:
    """The records of each leg [6] as those of a jack. Raises InputError where a signal that the cut needs is
    missing."""
    _check(whole)
    if has_load_cells(whole):
        forces = _measured(platform, whole)
    else:
        forces = payload_forces(platform, with_pressure_forces(platform, whole))
    borne = {
        role: [
            each + _burden(platform, legs)
            for each, legs in zip(forces.forces[role], together(whole, role), strict=True)
        ]
        for role in ROLES
    }
    rigs = [_moving(leg.rig, mass) for leg, mass in zip(platform.legs, forces.masses, strict=True)]
    return [CutLeg(_as_jack(whole[i], borne, forces, i), rig) for i, rig in enumerate(rigs)]


def _moving(rig: Rig, mass: float) -> Rig:
    sensors = {name: sensor for name, sensor in rig.sensors.items() if name not in _TAKEN}
    return replace(rig.with_values(M=float(mass)), sensors=sensors)


def _measured(platform: Platform, whole: Sequence[Campaign]) -> LegForces:
    """By load cells; at rest the platform still rings in them, so that noise is what is white in them."""
    forces = {
        role: [np.column_stack([leg.signals[CELL] for leg in legs]) for legs in together(whole, role)] for role in ROLES
    }
    sigma = np.array([white_part(CELL, campaign.records).sigma for campaign in whole])
    return LegForces(forces, sigma, (1.0,), rod_masses(platform))


def _burden(platform: Platform, legs: Sequence[Record]) -> np.ndarray:
    positions = np.column_stack([record.signals["position"] for record in legs])
    return rod_burden(platform, legs[0].t, platform.poses(positions))


def _as_jack(campaign: Campaign, forces: Mapping[str, list[np.ndarray]], noise: LegForces, leg: int) -> Campaign:
    """The campaign of one leg with its cut records; the noise of its force is that of an input."""
    weights = tuple(np.convolve(noise.weights, _HELD).tolist())
    roles = {
        role: tuple(_cut(*each) for each in zip(getattr(campaign, role), [f[:, leg] for f in own], strict=True))
        for role, own in forces.items()
    }
    own = InputNoise(float(noise.sigma[leg]), weights)
    return replace(campaign, **roles, input_noise={"disturbance": own})


def _cut(record: Record, force: np.ndarray) -> Record:
    """The force becomes an input that is held from row to row: the mean of both rows, or it would come half a period
    late."""
    now, after = _HELD
    load = now * force + after * np.append(force[1:], force[-1])
    kept = {name: values for name, values in record.signals.items() if name not in _TAKEN}
    valid = {name: record.valid[name] for name in kept}
    return replace(record, signals={**kept, "disturbance": load}, valid=valid, notes=())
