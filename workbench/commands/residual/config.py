"""What a command on a campaign folder reads: the campaign and a rig."""

from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ...records import Campaign, Record, load_campaign
from ...records.campaign import ROLES
from ...rigs.rig import Rig, load_rig


def load(folder: str | Path, rig: str | None) -> tuple[Campaign, Rig]:
    """A campaign with its own rig, or with the one that is named instead."""
    campaign = load_campaign(folder)
    return campaign, load_rig(rig or campaign.rig)


def fingerprint(campaign: Campaign) -> dict[str, Any]:
    """What says that a campaign is the same one: its folder's name, and a digest of every record."""
    return {"name": campaign.path.resolve().name} | {
        role: {record.name: _digest(record) for record in getattr(campaign, role)} for role in ROLES
    }


def _digest(record: Record) -> str:
    arrays = [record.t, *(record.signals[n] for n in sorted(record.signals)), *record.valid.values()]
    return sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()[:16]
