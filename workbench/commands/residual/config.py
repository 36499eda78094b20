"""What a command on a campaign folder reads: the campaign and a rig."""

import argparse

from ...records import Campaign
from ...records.campaign import judged_by
from ...rigs.driven import load_driven
from ...rigs.rig import Rig
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
    campaign, rig = load_driven(options.campaign, options.rig or "")
    return judged_by(campaign, options.heldout) if options.heldout else campaign, rig
