"""`jackbench fit CAMPAIGN`: the numbers of a rig that have bounds, fitted to its records."""

import argparse
from dataclasses import replace
from functools import partial

from ...records.campaign import FREE_RUN
from ..common.rig_out import finish_with_rig, leaves_rig
from ..residual.config import fingerprint, load, on_campaign

STARTS = 3


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    on_campaign(parser)
    parser.add_argument(
        "--starts", type=int, default=STARTS, help=f"number of places to start from (default: {STARTS})"
    )
    parser.add_argument(
        "--free-run", action="store_true", help="fit one run through each whole record, not windows of 0.5 s"
    )
    leaves_rig(parser, _fit)


def _fit(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = load(options)
    campaign = replace(campaign, score=FREE_RUN) if options.free_run else campaign
    from .study import run_fit

    identity = {"command": "fit", "campaign": fingerprint(campaign), "rig": rig.table()}
    identity["starts"] = options.starts
    name = campaign.path.resolve().name
    finish_with_rig(options, words, name, identity, partial(run_fit, campaign, rig, options.starts))
