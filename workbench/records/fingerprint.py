"""What says that a campaign is the same one, without its files being kept."""

from hashlib import sha256
from typing import Any

import numpy as np

from .campaign import ROLES, Campaign
from .record import Record
from .sessions import Drift


def fingerprint(campaign: Campaign) -> dict[str, Any]:
    """What says that a campaign is the same one: folder's name, score, a digest of every record, sessions, drifts."""
    records = {role: {record.name: digest(record) for record in getattr(campaign, role)} for role in ROLES}
    sessions = [
        {"name": each.name, "records": list(each.records), "numbers": list(each.numbers)}
        | ({"per": each.per} if isinstance(each, Drift) else {})
        for each in (*campaign.sessions, *campaign.drifts)
    ]
    same = {"name": campaign.path.resolve().name, "score": campaign.score}
    return same | records | ({"sessions": sessions} if sessions else {})


def digest(record: Record) -> str:
    """The digest of all that a record has."""
    arrays = [record.t, *(record.signals[n] for n in sorted(record.signals)), *record.valid.values()]
    late = [np.array([record.late])] if record.late else []
    return sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in (*arrays, *late))).hexdigest()[:16]
