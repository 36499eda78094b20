"""`jackbench plan CAMPAIGN`: what to record next."""

import argparse
from functools import partial

from ..common.options import computes, finish
from ..residual.config import fingerprint, load, on_campaign


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    on_campaign(parser)
    computes(parser, _plan)


def _plan(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = load(options)
    from .study import run_plan

    identity = {"command": "plan", "campaign": fingerprint(campaign), "rig": rig.table()}
    finish(options, words, f"plan-{campaign.path.resolve().name}", identity, partial(run_plan, campaign, rig))
