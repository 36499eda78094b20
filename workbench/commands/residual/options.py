"""`jackbench residual CAMPAIGN`: a rig's model beside the held-out records of a campaign folder."""

import argparse
from functools import partial

from ...base.errors import InputError
from ...records.campaign import campaign_rig
from ...records.fingerprint import fingerprint
from ...rigs.platform import is_platform
from ..common.options import computes, finish
from .config import load, on_campaign


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    on_campaign(parser)
    parser.add_argument(
        "--free-run", action="store_true", help="also give the error of one run through each whole record"
    )
    computes(parser, _residual)


def _residual(options: argparse.Namespace, words: list[str]) -> None:
    if is_platform(name := options.rig or campaign_rig(options.campaign)):
        _platform_residual(options, words, name)
        return
    campaign, rig = load(options)
    from .study import run_residual

    identity = {"command": "residual", "campaign": fingerprint(campaign), "rig": rig.table()}
    identity["free_run"] = options.free_run
    name = f"residual-{campaign.path.resolve().name}"
    study = partial(run_residual, campaign, rig, free_run=options.free_run)
    finish(options, words, name, identity, study)


def _platform_residual(options: argparse.Namespace, words: list[str], name: str) -> None:
    if options.free_run:
        raise InputError("--free-run is for one jack, and a platform's legs are judged in windows; leave it out")
    from ..common.legs import leg_campaigns
    from .platform import run_platform_residual

    legs = leg_campaigns(options, name)
    study = partial(run_platform_residual, legs.platform, legs.cut)
    finish(options, words, f"residual-{legs.name}", legs.identity("residual"), study)
