"""The commands that fit a rig to recordings, ask what it lacks, and say how often that answer is right."""

import argparse
from functools import partial
from pathlib import Path
from typing import Any

from .command import Call, Study, check_place, computes, finish, jobs, works
from .errors import InputError
from .records import Campaign
from .rig import rig_table
from .studies import fit, residual, trace, trace_study


def add(commands: Any) -> None:
    """Commands that fit a rig to recordings, and ask what it lacks."""
    fitted = commands.add_parser(
        "fit", help="fit a rig's numbers to recordings", description="Fit the numbers of a rig that have bounds."
    )
    fitted.add_argument("campaign", help="folder with a campaign.toml")
    fitted.add_argument("--starts", type=int, default=fit.STARTS, help=f"places to start from (default: {fit.STARTS})")
    _leaves_rig(fitted, _fit)
    traced = commands.add_parser(
        "trace", help="why do model and rig disagree", description="Trace the residual to what the model lacks."
    )
    traced.add_argument("campaign", help="folder with a campaign.toml")
    traced.add_argument("--effects", type=Path, nargs="+", default=[], metavar="FILE.py", help="effects of your own")
    traced.add_argument("--without", nargs="+", default=[], metavar="NAME", help="effects that are not to be tried")
    traced.add_argument(
        "--several", action="store_true", help="the rig lacks more than one effect: add those that explain a part too"
    )
    _leaves_rig(traced, _trace)
    studied = commands.add_parser(
        "trace-study", help="how often is a trace right", description="Trace campaigns whose truth is known, and score."
    )
    studied.add_argument("--campaigns", type=Path, metavar="DIR", help="folders with a truth.json beside them")
    studied.add_argument("--number", type=int, default=100, metavar="N", help="campaigns to draw (default: 100)")
    studied.add_argument("--seed", type=int, default=0, help="of what is drawn (default: 0)")
    works(studied)
    studied.add_argument("--keep", type=Path, metavar="DIR", help="leave the drawn campaigns there")
    computes(studied, _trace_study, rig=False)


def _leaves_rig(command: argparse.ArgumentParser, call: Call) -> None:
    command.add_argument("--rig-out", type=Path, metavar="FILE", help="also write the rig as found, a .toml file")
    computes(command, call)


def _fit(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = residual.load(options.campaign, options.rig)
    identity = {"command": "fit", "campaign": residual.fingerprint(campaign), "rig": rig_table(rig)}
    identity["starts"] = options.starts
    _finish_with_rig(options, words, campaign, identity, partial(fit.run_fit, campaign, rig, options.starts))


def _trace(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = residual.load(options.campaign, options.rig)
    files = [str(file.resolve()) for file in options.effects]
    library = trace.effects_for(rig, files, options.without)
    identity = {"command": "trace", "campaign": residual.fingerprint(campaign), "rig": rig_table(rig)}
    identity |= {"effects": trace.digest((*rig.effect_files, *files)), "without": sorted(options.without)}
    identity["several"] = options.several
    study = partial(trace.run_trace, campaign, rig, library, files=files, several=options.several)
    _finish_with_rig(options, words, campaign, identity, study)


def _finish_with_rig(
    options: argparse.Namespace, words: list[str], campaign: Campaign, identity: dict[str, Any], study: Study
) -> None:
    """Finish a study that leaves a rig.toml, which --rig-out is a copy of."""
    out = options.rig_out
    if out is not None:
        if out.suffix != ".toml":
            raise InputError(f"--rig-out {out}: name a .toml file")
        check_place(out, "--rig-out")
        if out.exists() and not options.force:
            raise InputError(f"--rig-out {out}: exists already; choose another or add --force to replace it")
    outcome = finish(options, words, f"{identity['command']}-{campaign.path.resolve().name}", identity, study)
    if out is not None:
        out.write_text(outcome.files["rig.toml"], encoding="utf-8")


def _trace_study(options: argparse.Namespace, words: list[str]) -> None:
    for name, least in (("number", 1), ("seed", 0)):
        value = getattr(options, name)
        if value < least:
            raise InputError(f"--{name} {value}: must be {least} or more")
    folder = options.campaigns
    plan = trace_study.given(folder) if folder else trace_study.default_plan(options.number, options.seed)
    if options.keep is not None:
        options.keep.mkdir(parents=True, exist_ok=True)
    identity = {"command": "trace-study", "items": trace_study.identity(plan)}
    name = f"trace-study-{folder.resolve().name}" if folder else "trace-study"
    study = partial(trace_study.run_trace_study, plan, trace.traced, jobs=jobs(options), keep=options.keep)
    finish(options, words, name, identity, study)
