"""`jackbench plan CAMPAIGN`: what to record next."""

import argparse
from functools import partial

from ...records.fingerprint import fingerprint
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
