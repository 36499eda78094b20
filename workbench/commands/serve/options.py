"""`jackbench serve RIG`: its arguments."""

import argparse
import shutil
from dataclasses import fields
from functools import partial
from itertools import chain, count
from pathlib import Path

from ..common.options import bounded, computes, finish, on_opc_ua, on_port
from .config import Service, service


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="a bundled rig or platform, or its file")
    parser.add_argument("--rate", type=float, metavar="HZ", help="control rate (default: the rig's own)")
    on_port(parser, "--port", "UDP port")
    pace = parser.add_mutually_exclusive_group()
    pace.add_argument("--lockstep", action="store_true", help="let the client set the pace: one command, one period")
    pace.add_argument("--realtime", action="store_true", help="let the clock set the pace (default)")
    bounded(parser, "--seed", 0, "seed of the sensor noise (default: 0)", default=0)
    parser.add_argument("--ideal", action="store_true", help="leave out noise, resolution and computing delay")
    parser.add_argument("--effects", type=Path, metavar="FILE.toml", help="file of [[effects]] to add to the rig")
    what = 'put it on the load cell: its stiffness, such as "1e7 N/m", or one of a rig set, such as stiffness-1e6'
    parser.add_argument("--specimen", metavar="STIFFNESS", help=what)
    bind = "address to listen on (default: this machine alone)"
    parser.add_argument("--bind", dest="host", default="", metavar="HOST", help=bind)
    parser.add_argument("--token", default="", help="text that a client's hello must have; needed with --bind")
    on_port(parser, "--page-port", "port of the page")
    on_opc_ua(parser)
    computes(parser, _serve, rig=False)


def _serve(options: argparse.Namespace, words: list[str]) -> None:
    wanted = Service(**{entry.name: getattr(options, entry.name) for entry in fields(Service)})
    rig = service(wanted, options.rig, options.rate, options.effects, options.specimen)
    from .study import run_service

    identity = {"command": "serve", "rig": rig.table(), "seed": wanted.seed, "lockstep": wanted.lockstep}
    name = f"serve-{rig.name}"
    own = None if options.out or options.force else _free_folder(name)
    options.out = options.out or own
    try:
        finish(options, words, name, identity, partial(run_service, rig, wanted))
    except KeyboardInterrupt:  # before it served, or a second one after: there is nothing to resume
        if own is not None:
            shutil.rmtree(_at_work(own), ignore_errors=True)
        raise


def _free_folder(name: str) -> Path:
    """The first of out/NAME, out/NAME-2 and so on in which no service was or is; it is this one's from now on."""
    names = chain([name], (f"{name}-{number}" for number in count(2)))
    return next(out for each in names if _claimed(out := Path("out", each)))


def _at_work(out: Path) -> Path:
    return out.with_name(f"{out.name}.partial")


def _claimed(out: Path) -> bool:
    """Whether nobody was there; what else is wrong with the place, the run says in words."""
    if out.exists():
        return False
    try:
        _at_work(out).mkdir(parents=True)
    except FileExistsError:
        return False
    except OSError:
        pass
    return True
