"""`jackbench live EXPERIMENT`."""

import argparse
from contextlib import suppress

from ..common.options import on_port
from ..common.shipped import experiment


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("experiment", type=experiment, help="a step, tune or bench experiment")
    on_port(parser, "--port", "port on 127.0.0.1")
    parser.set_defaults(call=_live)


def _live(options: argparse.Namespace, _words: list[str]) -> None:
    from ...base.process_pool import worker_processes
    from ..common.page_server import page_server
    from .config import load_live

    config = load_live(options.experiment)
    from .limit import limit_finder
    from .page import page_files
    from .session import Session

    with suppress(KeyboardInterrupt), worker_processes(1, limit_finder) as limit_of:
        session = Session(config, limit_of)
        with page_server(page_files(session.start()), session.answers, options.port) as server:
            server.serve()
