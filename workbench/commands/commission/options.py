"""`jackbench commission RIG.toml --at udp://HOST:PORT`: its arguments."""

import argparse
from functools import partial

from ...base.errors import InputError, nearest
from ...loop.scenarios import SCENARIOS
from ...rigs.rig_file import load_rig
from ..common.options import bounded, computes, finish_in_folder, on_link, processes, works

_MOST = 1000.0  # minutes


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="the rig of the datasheet, with bounds: a bundled rig or a rig file")
    on_link(parser, required=True)
    minutes = partial(bounded, parser, most=_MOST, kind=float, metavar="M")
    minutes("--minutes", 2.0, "longest time on the rig (default: 10)", default=10.0)
    computing = "longest CPU minutes that it computes, all processes together (default: 20)"
    minutes("--computing", 1.0, computing, default=20.0)
    parser.add_argument(
        "--goal",
        default="position-10mm",
        metavar="SCENARIO",
        help="step that the search makes settle soonest (default: position-10mm)",
    )
    works(parser, cluster=False)
    computes(parser, _commission, rig=False)


def _commission(options: argparse.Namespace, words: list[str]) -> None:
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
