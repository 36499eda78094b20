"""`jackbench watch FOLDER`: its arguments."""

import argparse
import re
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

from ...base.errors import InputError
from ..common.options import computes, finish, jobs, works
from ..common.shipped import experiment
from ..common.step_experiment import StepConfig, load_steps

_RATE = re.compile(r"(\d+(?:\.\d+)?) per (?:(\d+(?:\.\d+)?) )?(year|month|week)s?")
_A_YEAR = {"year": 1.0, "month": 12.0, "week": 52.18}
_ALARM = 3


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "folder",
        type=Path,
        help="folder of a rig with one dated campaign for each session, or of several such folders",
    )
    parser.add_argument(
        "--false-alarms",
        default="1 per 2 years",
        metavar="RATE",
        help='rate at which a healthy rig may raise an alarm (default: "1 per 2 years")',
    )
    parser.add_argument(
        "--loop",
        type=experiment,
        default="position_tuned",
        metavar="EXPERIMENT",
        help="experiment of the controller to judge on the rig (default: position_tuned, which is shipped)",
    )
    parser.add_argument("--controller", default="p-dp", metavar="NAME", help="controller of --loop (default: p-dp)")
    parser.add_argument("--exit-code", action="store_true", help="exit with status 3 while there is an alarm, for cron")
    works(parser)
    computes(parser, _watch)


def _watch(options: argparse.Namespace, words: list[str]) -> None:
    a_year = alarms_a_year(options.false_alarms)
    from ...records.dated_sessions import dated_sessions
    from .page import standing
    from .retuning import retuned
    from .rigs import rig_folders, run_watches
    from .study import identity, read_identity, run_watch, watched_rig

    retuning = partial(retuned, options.loop, options.controller)
    loop, name = loop_of(options.loop, options.controller), f"watch-{options.folder.resolve().name}"
    if folders := rig_folders(options.folder):
        whole = {"command": "watch", "folders": [read_identity(each) for each in folders], "loop": loop.source}
        whole |= {"false_alarms_a_year": a_year, "rig": options.rig}
        study = partial(run_watches, folders, options.rig, loop, a_year, retuning, jobs=jobs(options))
    else:
        if options.cluster:
            raise InputError(f"--cluster shares rigs among workers, and {options.folder} has one; leave it out")
        found = dated_sessions(options.folder)
        rig = watched_rig(found, options.rig)
        whole, study = identity(found, rig, loop, a_year), partial(run_watch, found, rig, loop, a_year, retuning)
    outcome = finish(options, words, name, whole, study)
    if options.exit_code and standing(outcome.metrics["alarms"]):
        sys.stdout.flush()
        sys.exit(_ALARM)


def loop_of(path: Path, name: str) -> StepConfig:
    """The experiment with that controller alone, and its step of 10 mm or its first scenario. Raises InputError."""
    loop = load_steps(path, only=name)
    scenario = next((each for each in loop.scenarios if each.name == "position-10mm"), loop.scenarios[0])
    return replace(loop, scenarios=(scenario,))


def alarms_a_year(text: str) -> float:
    """False alarms a year of a text such as "1 per 2 years". Raises InputError."""
    match = _RATE.fullmatch(text.strip())
    if not match or float(match[1]) <= 0 or float(match[2] or 1) <= 0:
        raise InputError(f'--false-alarms {text}: write how many in which time, such as "1 per 2 years"')
    return float(match[1]) / float(match[2] or 1) * _A_YEAR[match[3]]
