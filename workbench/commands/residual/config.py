"""What a command on a campaign folder reads: the campaign and a rig."""

import argparse
from hashlib import sha256
from typing import Any

import numpy as np

from ...records import Campaign, Record, load_campaign
from ...records.campaign import ROLES, judged_by
from ...records.sessions import Drift
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig
from ..common.shipped import campaign as campaign_folder


def on_campaign(parser: argparse.ArgumentParser) -> None:
    """Which campaign a command works on, and which of its records judge."""
    parser.add_argument("campaign", type=campaign_folder, help="a folder with a campaign.toml")
    holds_out(parser)


def holds_out(parser: argparse.ArgumentParser) -> None:
    """Which of a campaign's records judge."""
    parser.add_argument(
        "--heldout",
        nargs="+",
        default=[],
        metavar="NAME",
        help='names or patterns ("*_5V_*") of records to hold out, instead of the campaign\'s; the others are fitted',
    )


def load(options: argparse.Namespace) -> tuple[Campaign, Rig]:
    """The campaign as asked for, with its own rig, or with the one that is named instead."""
    campaign = load_campaign(options.campaign)
    if options.heldout:
        campaign = judged_by(campaign, options.heldout)
    return campaign, load_rig(options.rig or campaign.rig, corrector=campaign.corrector)


def fingerprint(campaign: Campaign) -> dict[str, Any]:
    """What says that a campaign is the same one: folder's name, score, a digest of every record, sessions, drifts."""
    records = {role: {record.name: _digest(record) for record in getattr(campaign, role)} for role in ROLES}
    sessions = [
        {"name": each.name, "records": list(each.records), "numbers": list(each.numbers)}
        | ({"per": each.per} if isinstance(each, Drift) else {})
        for each in (*campaign.sessions, *campaign.drifts)
    ]
    same = {"name": campaign.path.resolve().name, "score": campaign.score}
    return same | records | ({"sessions": sessions} if sessions else {})


def _digest(record: Record) -> str:
    arrays = [record.t, *(record.signals[n] for n in sorted(record.signals)), *record.valid.values()]
    late = [np.array([record.late])] if record.late else []
    return sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in (*arrays, *late))).hexdigest()[:16]
