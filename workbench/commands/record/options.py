"""`jackbench record RIG`: plays excitations on a rig, in simulation or live, and leaves a campaign folder."""

import argparse
from functools import partial
from pathlib import Path

from ...base.errors import InputError
from ...rigs.platform import is_platform
from ..common.options import bounded, computes, finish, on_link
from .config import identity, plan


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="a bundled rig or platform, or its file, with or without [[effects]]")
    parser.add_argument(
        "--play",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help="files of excitations, of a platform of poses; the last one is held out",
    )
    bounded(parser, "--seed", 0, "seed of the sensor noise (default: 0)", default=0)
    on_link(parser, required=False)
    computes(parser, _record, rig=False)


def _record(options: argparse.Namespace, words: list[str]) -> None:
    if is_platform(options.rig):
        _record_platform(options, words)
        return
    planned = plan(options.rig, options.play, options.seed)
    if options.at is not None:
        from .live import run_live

        whole = {"command": "record", "rig": planned.rig.table(), "at": options.at, **identity(planned)}
        study = partial(run_live, planned, options.at, options.token)
        finish(options, words, f"record-{planned.rig.name}", whole, study)
        return
    from .study import run_record

    whole = {"command": "record", "rig": planned.rig.table(), **identity(planned)}
    finish(options, words, f"record-{planned.rig.name}", whole, partial(run_record, planned))


def _record_platform(options: argparse.Namespace, words: list[str]) -> None:
    if options.at is not None:
        raise InputError("--at is for one jack; take it out: a platform is recorded in simulation")
    from .platform import identity as identity_of, platform_plan, run_platform_record

    planned = platform_plan(options.rig, options.seed, options.play)
    study = partial(run_platform_record, planned)
    finish(options, words, f"record-{planned.platform.name}", identity_of(planned), study)
