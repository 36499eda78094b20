"""`jackbench open [RUN]`: a finished run's report, in the browser of this machine."""

import argparse
from pathlib import Path

from ...base.desktop import show_file
from ...base.errors import InputError

_REPORT = "report.html"


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "run", nargs="?", metavar="RUN", help="folder of a run, or its name in out/ (default: the newest)"
    )
    parser.set_defaults(call=_open)


def _open(options: argparse.Namespace, _words: list[str]) -> None:
    report = report_of(options.run)
    opened = show_file(report)
    print(report if opened else f"{report}: open it in a browser; there is no desktop here")


def report_of(run: str | None, home: Path = Path("out")) -> Path:
    """The report of a run's folder, or of a run in `home` by its name; of the newest run there where none is named.

    Raises InputError where there is no such report.
    """
    if run is None:
        reports = list(home.glob(f"*/{_REPORT}"))
        if not reports:
            raise InputError(f"{home}: no finished run; jackbench run first_loop leaves one")
        return max(reports, key=lambda path: path.stat().st_mtime)
    places = Path(run), home / run
    for path in places:
        if path.suffix == ".html" and path.is_file():
            return path
        if (path / _REPORT).is_file():
            return path / _REPORT
    raise InputError(f"{run}: no {_REPORT} there, nor in {places[1]}; name a folder that a command left")
