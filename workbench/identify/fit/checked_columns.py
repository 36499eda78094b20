"""What every command on a campaign does before it computes: columns that are not what they are called are refused."""

import json
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path

from ...base.errors import InputError
from ...base.recent import Recent
from ...records import Campaign, Record
from ...records.campaign import ROLES
from ...records.fingerprint import digest
from ...rigs.rig import Rig
from ..data.noise_floor import NoiseFloor
from .mistaken import mistaken
from .mistakes import Mistake

_FOUND = Recent[str, tuple[Mistake | None]](1000.0, lambda _: 1.0)  # by what was asked


class MistakenColumns(InputError):
    """Columns that are not what they are called, and the mistake that was found."""

    def __init__(self, where: str, mistake: Mistake) -> None:
        super().__init__(where)
        self.mistake = mistake


def check_columns(campaign: Campaign, rig: Rig, floor: NoiseFloor) -> None:
    """Raises MistakenColumns for columns that are not what they are called, naming what they seem to be."""
    mistake = found_mistake(campaign, rig, floor)
    if mistake is not None:
        raise MistakenColumns(f"{campaign.path}: {mistake.told(rig.name)}; {mistake.remedy}", mistake)


def found_mistake(campaign: Campaign, rig: Rig, floor: NoiseFloor) -> Mistake | None:
    """What `mistaken` finds; a process seeks it once in the same records of the same rig, which takes seconds."""
    return _FOUND.get(_asked(campaign, rig, floor), lambda: (mistaken(campaign, rig, floor),))[0]


def _asked(campaign: Campaign, rig: Rig, floor: NoiseFloor) -> str:
    """What says that the same is asked."""
    own = [sha256(Path(file).read_bytes()).hexdigest() for file in rig.effect_files]
    records = [list(map(_record, getattr(campaign, role))) for role in ROLES]
    asked = [records, campaign.score, repr(campaign.sessions), rig.table(), own, asdict(floor)]
    return sha256(json.dumps(asked, sort_keys=True, default=str).encode()).hexdigest()


def _record(record: Record) -> list[str]:
    return [record.name, *sorted(record.signals), *record.valid, digest(record)]
