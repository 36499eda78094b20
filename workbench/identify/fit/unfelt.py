"""A force column of a rig that has nothing for a load cell to feel: the model's force would be 0 whatever is fitted."""

import numpy as np

from ...base.signals import SIGNALS
from ...plant.effects import resolve
from ...records import Campaign, Record
from ...rigs.load import ROD_CELL
from ...rigs.rig import Rig
from ..data.noise_floor import NoiseFloor

_LOUD = 3.0  # standard deviations of the noise: a force that moves less is that of an idle cell
_SPRING = 0.7  # correlation with the position: above, it is a spring that no file declares, which `trace` names
_INPUTS = ("load_setting", "disturbance")  # that a record may carry, and that a cell feels


def unfelt_force(campaign: Campaign, rig: Rig, floor: NoiseFloor) -> tuple[str, str] | None:
    """What a record's force is, and the remedy, where the rig cannot have it; None where it can, or is silent."""
    if any("load" in effect.laws for effect, _ in resolve(rig)):
        return None
    for record in campaign.records:
        if rig.in_session(campaign.session_of(record.name)).cell_is_idle and _moves(record, floor):
            swing = SIGNALS["force"].text(float(f"{np.ptp(record.signals['force'][record.valid['force']]):.3g}"))
            return (
                f"record {record.name}: force goes over {swing}, and {rig.name} has nothing that a load cell feels",
                f'declare under [load] of the rig the specimen (ks), or kind = "{ROD_CELL}" and Mr where the cell is '
                'between rod and mass; or leave the column out by unused = ["force"] in campaign.toml',
            )
    return None


def _moves(record: Record, floor: NoiseFloor) -> bool:
    """Whether a force is no noise, no input's, and no spring's."""
    if "force" not in record.signals or any(name in record.signals for name in _INPUTS):
        return False
    names = [name for name in ("force", "position") if name in record.signals]
    rows = np.all([record.valid[name] for name in names], axis=0)
    force, *position = (record.signals[name][rows] for name in names)
    if force.size == 0 or np.std(force) < _LOUD * floor.sigma.get("force", np.inf):
        return False
    return not position or np.ptp(position[0]) == 0 or np.corrcoef(force, position[0])[0, 1] < _SPRING
