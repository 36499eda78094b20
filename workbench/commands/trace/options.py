"""`jackbench trace CAMPAIGN`: the residual of a campaign, traced to what the model lacks."""

import argparse
from functools import partial
from pathlib import Path

from ..common.rig_out import finish_with_rig, leaves_rig
from ..residual.config import load, on_campaign


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    on_campaign(parser)
    parser.add_argument("--effects", type=Path, nargs="+", default=[], metavar="FILE.py", help="effects of your own")
    parser.add_argument("--without", nargs="+", default=[], metavar="NAME", help="effects that are not to be tried")
    parser.add_argument(
        "--several", action="store_true", help="the rig lacks more than one effect: add those that explain a part too"
    )
    leaves_rig(parser, _trace)


def _trace(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = load(options)
    from .study import effects_for, identity, run_trace

    files = [str(file.resolve()) for file in options.effects]
    library = effects_for(rig, files, options.without)
    command = identity(campaign, rig, files, options.without, options.several)
    study = partial(run_trace, campaign, rig, library, files=files, several=options.several)
    finish_with_rig(options, words, campaign, command, study)
