"""`jackbench fit CAMPAIGN`: the numbers of a rig that have bounds, fitted to its records."""

import argparse
from functools import partial

from ...rigs.rig import rig_table
from ..common.rig_out import finish_with_rig, leaves_rig
from ..common.shipped import campaign as campaign_folder
from ..residual.config import fingerprint, load

STARTS = 3


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("campaign", type=campaign_folder, help="folder with a campaign.toml")
    parser.add_argument("--starts", type=int, default=STARTS, help=f"places to start from (default: {STARTS})")
    leaves_rig(parser, _fit)


def _fit(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = load(options.campaign, options.rig)
    from .study import run_fit

    identity = {"command": "fit", "campaign": fingerprint(campaign), "rig": rig_table(rig)}
    identity["starts"] = options.starts
    finish_with_rig(options, words, campaign, identity, partial(run_fit, campaign, rig, options.starts))
