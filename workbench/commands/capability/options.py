"""`jackbench capability RIG|PLATFORM`: its arguments."""

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.errors import InputError
from ...base.units import Spec
from ...rigs.platform import is_platform, load_platform
from ...rigs.rig_file import load_rig
from ..common.options import finish, measured
from ..common.outcome import Outcome, Progress, Stage
from ..common.sheet_options import (
    Made,
    campaign_digests,
    check_jack,
    check_metered,
    file_digests,
    limit_tables,
    limits_of,
    sheet_options,
)

if TYPE_CHECKING:
    from .config import CapabilityAsked

_Task = tuple[str, dict[str, Any], Callable[[Stage, Progress], Outcome]]  # a folder's name, an identity, a study

_OF_A_JACK = ("campaign", "loop", "drive", "pump")  # options that a platform does not have
_WITH_DRIVE = ("band", "cooler", "catalogue")
_SAG = 0.1
_FLOW = Spec("m^3/s", 1e-9, 10.0, "flow of the pump")
_BAND = Spec("Hz", 0.01, 1e3, "band of the drive file")
_POWER = Spec("W", 1.0, 1e9, "cooler that has to carry the drive file's heat")


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    sheet_options(parser, _capability, "RIG|PLATFORM")
    parser.add_argument("--campaign", type=Path, metavar="DIR", help="a campaign folder with sines of the position")
    parser.add_argument(
        "--loop",
        metavar="EXPERIMENT",
        help="experiment of the controller that plays the sines (default: it tunes itself)",
    )
    parser.add_argument("--controller", default="p-dp", metavar="NAME", help="controller of --loop (default: p-dp)")
    measured(parser, "--pump", _FLOW, f"{_FLOW.meaning}, such as '100 l/min'", "FLOW")
    parser.add_argument("--drive", type=Path, metavar="FILE", help="a drive file: a CSV with t and position")
    measured(parser, "--band", _BAND, f"{_BAND.meaning} (default: half of the oil's mode)", "FREQUENCY")
    measured(parser, "--cooler", _POWER, f"{_POWER.meaning}, such as '20 kW'", "POWER")
    parser.add_argument(
        "--sag", type=float, metavar="PERCENT", help="fall of the supply that an accumulator may allow (default: 10)"
    )
    parser.add_argument("--catalogue", type=Path, metavar="FILE", help="a TOML with valves and pumps to choose from")


def _capability(options: argparse.Namespace, words: list[str]) -> None:
    from ..common.sheet_page import browser, printed

    if options.pdf:
        browser()  # refused before anything is computed
    if is_platform(options.subject):
        name, identity, study = _platform(options)
    else:
        name, identity, study = _jack(options)
    printed(options, finish(options, words, name, identity, study), name)


def _platform(options: argparse.Namespace) -> _Task:
    for name in (*_OF_A_JACK, *_WITH_DRIVE):
        if getattr(options, name) is not None:
            raise InputError(f"--{name}: is for one jack, and {options.subject} is a platform; leave it out")
    platform = load_platform(options.subject)
    for leg in platform.legs:
        check_metered(leg.rig)
    limits, digests = limits_of(options.limits)
    digests = file_digests(options.subject) | digests
    from .platform import run_platform_capability

    whole = {"command": "capability", "rig": platform.table(), "limits": limit_tables(limits), "files": digests}
    made = Made(platform.name, digests)
    return f"capability-{platform.name}", whole, partial(run_platform_capability, platform, made, limits)


def _jack(options: argparse.Namespace) -> _Task:
    rig = load_rig(options.subject)
    check_jack(rig)
    if not rig.is_throttled:
        raise InputError(
            f"{rig.name}: a {rig.valve} has no lands whose flow follows a pressure drop; name a rig with one"
        )
    check_metered(rig)
    from .config import CapabilityAsked
    from .study import run_capability

    limits, digests = limits_of(options.limits)
    digests = file_digests(options.subject) | digests
    asked = CapabilityAsked(rig, Made(rig.name, digests), limits=limits, pump=options.pump)
    asked, more = _with_loop(*_with_campaign(asked, options), options)
    asked, files = _with_drive(asked, options)
    asked = replace(asked, made=Made(rig.name, digests | more.pop("files") | files))
    given = {key: str(value) for key in ("pump", "band", "cooler", "sag") if (value := getattr(options, key))}
    whole = {"command": "capability", "rig": rig.table(), "limits": limit_tables(limits), "given": given}
    return f"capability-{rig.name}", whole | more | {"files": asked.made.digests}, partial(run_capability, asked)


def _with_campaign(asked: "CapabilityAsked", options: argparse.Namespace) -> tuple["CapabilityAsked", dict[str, Any]]:
    if options.campaign is None:
        return asked, {"files": {}}
    from ...records.campaign import load_campaign
    from ..common.shipped import campaign

    own = load_campaign(campaign(options.campaign))
    records = (*own.train, *own.select, *own.heldout)
    return replace(asked, records=records), {"files": campaign_digests(own)}


def _with_loop(
    asked: "CapabilityAsked", more: dict[str, Any], options: argparse.Namespace
) -> tuple["CapabilityAsked", dict[str, Any]]:
    if options.loop is None:
        return asked, more
    from ..common.shipped import experiment
    from ..watch.options import loop_of

    loop = loop_of(experiment(options.loop), options.controller)
    spec = loop.controllers[0]
    if spec.build(asked.rig.period.value).measures[0] != "position":
        raise InputError(
            f"--controller {options.controller}: sines move the position; name a controller of the position"
        )
    return replace(asked, loop=spec), more | {"loop": loop.source}


def _with_drive(asked: "CapabilityAsked", options: argparse.Namespace) -> tuple["CapabilityAsked", dict[str, str]]:
    if options.drive is None:
        for name in (*_WITH_DRIVE, "sag"):
            if getattr(options, name) is not None:
                raise InputError(f"--{name}: needs a drive file; name one with --drive")
        return asked, {}
    from .catalogue import load_catalogue
    from .config import DriveAsked, read_course

    sag = _SAG if options.sag is None else options.sag / 100
    if not 0 < sag < 1:
        raise InputError(f"--sag {options.sag:g}: must be between 0 and 100 %")
    catalogue = None if options.catalogue is None else load_catalogue(options.catalogue)
    position = read_course(options.drive, asked.rig)
    drive = DriveAsked(options.drive.name, position, options.band, options.cooler, sag, catalogue)
    read = [options.drive, *([options.catalogue] if options.catalogue else [])]
    return replace(asked, drive=drive), file_digests(*read)
