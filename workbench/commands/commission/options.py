"""`jackbench commission RIG.toml --at udp://HOST:PORT`: its arguments."""

import argparse
from functools import partial

from ...base.errors import InputError, nearest
from ...loop.scenarios import SCENARIOS
from ...rigs.rig_file import load_rig
from ..common.options import computes, finish_in_folder, on_link, processes, works

_LEAST = 2.0  # minutes
_LEAST_COMPUTING = 1.0  # the same


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="the rig of the datasheet, with bounds: a bundled rig or a rig file")
    on_link(parser, required=True)
    parser.add_argument(
        "--minutes", type=float, default=10.0, metavar="M", help="longest time on the rig (default: 10)"
    )
    parser.add_argument(
        "--computing", type=float, default=20.0, metavar="M",
        help="longest CPU minutes that it computes, all processes together (default: 20)",
    )  # fmt: skip
    parser.add_argument(
        "--goal",
        default="position-10mm",
        metavar="SCENARIO",
        help="step that the search makes settle soonest (default: position-10mm)",
    )
    works(parser, cluster=False)
    computes(parser, _commission, rig=False)


def _commission(options: argparse.Namespace, words: list[str]) -> None:
    if not _LEAST <= options.minutes < 1000:
        raise InputError(f"--minutes {options.minutes:g}: must be {_LEAST:g} or more, below 1000")
    if not _LEAST_COMPUTING <= options.computing < 1000:
        raise InputError(f"--computing {options.computing:g}: must be {_LEAST_COMPUTING:g} or more, below 1000")
    steps = [name for name, each in SCENARIOS.items() if each.signal == "position" and each.is_step]
    if options.goal not in steps:
        raise InputError(f"--goal {options.goal}: {nearest(options.goal, steps)}")
    rig = load_rig(options.rig)
    if "position" not in rig.sensors:
        raise InputError(f"rig {rig.name}: no position sensor, which its loop needs; add [sensors.position]")
    from .study import Wanted, run_commission

    minutes = 60 * options.minutes, 60 * options.computing
    wanted = Wanted(rig, options.at, options.token, *minutes, options.goal, processes(options))
    identity = {"command": "commission", "rig": rig.table(), "at": options.at, "goal": options.goal}
    finish_in_folder(options, words, f"commission-{rig.name}", identity, partial(run_commission, wanted))
