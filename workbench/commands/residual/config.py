"""What a command on a campaign folder reads: the campaign and a rig."""

import argparse

from ...records import Campaign, load_campaign
from ...records.campaign import judged_by
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
