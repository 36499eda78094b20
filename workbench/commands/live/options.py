"""`jackbench live EXPERIMENT`."""

import argparse

from ...base.errors import InputError
from ..common.shipped import experiment

_PORTS = 65535


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a step, tune or bench experiment")
    parser.add_argument("--port", type=int, default=0, metavar="N", help="port on 127.0.0.1 (default: a free one)")
    parser.set_defaults(call=_live)


def _live(options: argparse.Namespace, _words: list[str]) -> None:
    from .config import load_live

    if not 0 <= options.port <= _PORTS:
        raise InputError(f"--port {options.port}: must be from 0, a free one, to {_PORTS}")
    config = load_live(options.experiment)
    from .server import live_server
    from .session import Session

    with live_server(Session(config), options.port) as server:
        server.serve()
