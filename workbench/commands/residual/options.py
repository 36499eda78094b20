"""`jackbench residual CAMPAIGN`: a rig's model beside the held-out records of a campaign folder."""

import argparse
from functools import partial

from ..common.options import computes, finish
from .config import fingerprint, load, on_campaign


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    on_campaign(parser)
    parser.add_argument("--free-run", action="store_true", help="add the error of one run through each whole record")
    computes(parser, _residual)


def _residual(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = load(options)
    from .study import run_residual

    identity = {"command": "residual", "campaign": fingerprint(campaign), "rig": rig.table()}
    identity["free_run"] = options.free_run
    name = f"residual-{campaign.path.resolve().name}"
    study = partial(run_residual, campaign, rig, free_run=options.free_run)
    finish(options, words, name, identity, study)
