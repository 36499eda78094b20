"""`jackbench trace CAMPAIGN|SHEET.csv ...`: the residual of a campaign or of sheets, traced to what the model lacks."""

import argparse
from functools import partial
from pathlib import Path

from ...base import trust
from ...base.errors import InputError
from ...records.campaign import campaign_rig
from ...rigs.platform import is_platform
from ..common.options import finish, processes, works
from ..common.rig_out import finish_with_rig, leaves_rig
from ..common.sheet_options import read_lines
from ..common.shipped import campaign
from ..residual.config import holds_out, load
from .without import check_library


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "campaign", type=campaign, nargs="+", metavar="CAMPAIGN|SHEET.csv",
        help="a folder with a campaign.toml, or sheets of frequency responses (frequency, gain, phase)",
    )  # fmt: skip
    holds_out(parser)
    parser.add_argument(
        "--effects", type=Path, nargs="+", default=[], metavar="FILE.py", help="files with effects of your own"
    )
    parser.add_argument("--without", nargs="+", default=[], metavar="NAME", help="effects to leave out")
    parser.add_argument(
        "--several", action="store_true", help="add effects that explain only a part, for a rig that lacks several"
    )
    parser.add_argument(
        "--new", type=Path, metavar="SHEET.json",
        help="metrics.json of valve-test when the valve was new: say what differs from it now",
    )  # fmt: skip
    parser.add_argument("--input", default="command", help="input signal of sheets (default: command)")
    parser.add_argument("--output", help="output signal of sheets, such as spool")
    parser.add_argument(
        "--amplitude", nargs="+", action="extend", default=[], metavar="SIZE",
        help='amplitude of all sheets, or one for each sheet, such as "100 %%" of full input',
    )  # fmt: skip
    parser.add_argument(
        "--sigma", type=float, nargs=2, metavar=("DB", "DEG"), help="standard deviations of sheets (default: 0.2 2)"
    )
    works(parser, cluster=False)
    leaves_rig(parser, _trace)


def _trace(options: argparse.Namespace, words: list[str]) -> None:
    paths: list[Path] = options.campaign
    trust.allow(*options.effects)
    if all(path.is_file() and path.suffix != ".toml" for path in paths):
        if options.new is not None:
            raise InputError("--new belongs to a campaign, not to frequency-response sheets; take it out")
        from .sheet_files import read_sheets

        rig, sheets = read_sheets(options)
        from .sheets import trace_command

        return trace_command(options, words, rig, sheets)
    if missing := [path for path in paths if not path.exists()]:
        raise InputError(f"{missing[0]}: no such file; check the path")
    if len(paths) > 1:
        wrong = next(path for path in paths if not path.is_file())
        raise InputError(f"{wrong}: several arguments must all be sheets of frequency responses; name one campaign")
    if options.output or options.amplitude or options.sigma:
        raise InputError("--output, --amplitude and --sigma belong to sheets, not to a campaign; take them out")
    options.campaign = paths[0]
    if is_platform(name := options.rig or campaign_rig(paths[0])):
        return _trace_platform(options, words, name)
    check_library(options.without, options.rig or campaign_rig(paths[0]), options.effects)
    records, rig = load(options)
    from ...plant.effects.declared import effects_for
    from .study import identity, run_trace, run_trace_since

    files = [str(file.resolve()) for file in options.effects]
    library = effects_for(rig, files, options.without)
    command = identity(records, rig, files, options.without, options.several)
    shared = {"files": files, "jobs": processes(options)}
    study = partial(run_trace, records, rig, library, several=options.several, **shared)
    if options.new is not None:
        rows = read_lines(options.new)
        command |= {"new": {id: dict(row) for id, row in rows.items()}}
        study = partial(run_trace_since, options.new.name, rows, records, rig, library, **shared)
    return finish_with_rig(options, words, records.path.resolve().name, command, study)


def _trace_platform(options: argparse.Namespace, words: list[str], name: str) -> None:
    """Trace a platform's campaign, leg by leg."""
    if options.new is not None:
        raise InputError("--new is for the valve of one jack; a platform has several, name the campaign of one leg")
    if options.rig_out is not None:
        raise InputError("--rig-out is for one jack; the rigs of a platform's legs are left beside its report")
    from ..common.legs import leg_campaigns
    from .platform import run_platform_trace
    from .study import digest

    legs, files = leg_campaigns(options, name), [str(file.resolve()) for file in options.effects]
    asked = {"effects": digest(files), "without": sorted(options.without), "several": options.several}
    shared = {"files": files, "without": options.without, "several": options.several, "jobs": processes(options)}
    study = partial(run_platform_trace, legs.platform, legs.whole, legs.cut, **shared)
    finish(options, words, f"trace-{legs.name}", legs.identity("trace", **asked), study)
