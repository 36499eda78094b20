"""`jackbench plan CAMPAIGN`: what to record next."""

import argparse
from functools import partial

from ...base.errors import InputError
from ...records.campaign import campaign_rig
from ...records.fingerprint import fingerprint
from ...rigs.platform import is_platform
from ..common.options import computes, finish
from ..excite.config import SETS
from ..residual.config import load, on_campaign


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    on_campaign(parser)
    parser.add_argument(
        "--for", dest="sheet", choices=SETS, help="say instead which records a sheet of that command still misses"
    )
    computes(parser, _plan)


def _plan(options: argparse.Namespace, words: list[str]) -> None:
    if is_platform(name := options.rig or campaign_rig(options.campaign)):
        _plan_platform(options, words, name)
        return
    campaign, rig = load(options)
    if options.sheet is not None:
        from .sheets import run_sheet_plan

        whole = {"command": "plan", "for": options.sheet, "campaign": fingerprint(campaign), "rig": rig.table()}
        name = f"plan-{options.sheet}-{campaign.path.resolve().name}"
        finish(options, words, name, whole, partial(run_sheet_plan, options.sheet, campaign, rig))
        return
    from .study import run_plan

    identity = {"command": "plan", "campaign": fingerprint(campaign), "rig": rig.table()}
    finish(options, words, f"plan-{campaign.path.resolve().name}", identity, partial(run_plan, campaign, rig))


def _plan_platform(options: argparse.Namespace, words: list[str], name: str) -> None:
    """Plan a platform's campaign, leg by leg."""
    if options.sheet is not None:
        raise InputError(f"--for {options.sheet} is for one jack, and this is a campaign of a platform; leave it out")
    from ...identify.wrench.leg_cut import has_load_cells
    from ..common.legs import leg_campaigns
    from .platform import run_platform_plan

    legs = leg_campaigns(options, name)
    if not has_load_cells(legs.whole):
        raise InputError(
            f"{options.campaign}: a leg without a load cell, by which a plan cuts motions leg by leg; record its force"
        )
    study = partial(run_platform_plan, legs.platform, legs.whole, legs.cut)
    finish(options, words, f"plan-{legs.name}", legs.identity("plan"), study)
