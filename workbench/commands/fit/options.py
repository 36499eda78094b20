"""`jackbench fit CAMPAIGN`: the numbers of a rig that have bounds, fitted to its records."""

import argparse
from dataclasses import replace
from functools import partial

from ...base.errors import InputError
from ...records.campaign import FREE_RUN, campaign_rig
from ...records.fingerprint import fingerprint
from ...rigs.platform import is_platform
from ..common.options import finish
from ..common.rig_out import finish_with_rig, leaves_rig
from ..residual.config import load, on_campaign

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
    if is_platform(name := options.rig or campaign_rig(options.campaign)):
        return _fit_platform(options, words, name)
    campaign, rig = load(options)
    campaign = replace(campaign, score=FREE_RUN) if options.free_run else campaign
    from .study import run_fit

    identity = {"command": "fit", "campaign": fingerprint(campaign), "rig": rig.table()}
    identity["starts"] = options.starts
    name = campaign.path.resolve().name
    return finish_with_rig(options, words, name, identity, partial(run_fit, campaign, rig, options.starts))


def _fit_platform(options: argparse.Namespace, words: list[str], name: str) -> None:
    """Fit a platform's campaign: payload and legs."""
    if options.free_run:
        raise InputError("--free-run is for one jack, and a platform's legs are fitted in windows; leave it out")
    if options.rig_out is not None:
        raise InputError("--rig-out is for one jack; platform.toml and its legs are left beside the report")
    from ..common.legs import leg_campaigns
    from .platform import run_platform_fit

    legs = leg_campaigns(options, name)
    identity = legs.identity("fit", of_cut=False, starts=options.starts)
    finish(options, words, f"fit-{legs.name}", identity, partial(run_platform_fit, legs, options.starts))
