"""`jackbench new DIR`: a starter folder with a rig, experiments, a campaign and a controller."""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from ...rigs.datasheet import load_datasheet
from ...rigs.platform import load_rig_or_platform
from ...rigs.rig import Rig
from ..common.new_folder import check_new, write_folder
from .ask import STAGES, asked_datasheet, asked_label
from .closed_loop import closed_loop_files

_DATASHEET = "datasheet.toml"
CLOSED_LOOP = "closed-loop"


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="the folder to make")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--rig", default="jack-10t", help="a bundled rig or platform, or its file (default: jack-10t)")
    source.add_argument(
        "--datasheet", type=Path, metavar="FILE", help="build the rig from this datasheet, as new-rig does"
    )
    what = "ask for the numbers of a valve's, jack's and load's datasheet, or for the label of a jack in a closed loop"
    source.add_argument("--ask", choices=(*STAGES, CLOSED_LOOP), help=what)
    parser.set_defaults(call=_new)


def _new(options: argparse.Namespace, _words: list[str]) -> None:
    folder = options.folder
    check_new(folder)
    files = _files(options)
    write_folder(folder, files)
    print(f"{folder}: {', '.join(files)}\nnext: cd {folder}, and what README.md says")


def _files(options: argparse.Namespace) -> dict[str, str]:
    """The text of every file, by its path in the folder."""
    if options.ask == CLOSED_LOOP:
        return closed_loop_files(asked_label(), options.folder.name)
    sheet: dict[str, str] = {}
    if options.ask is not None:
        sheet = {_DATASHEET: asked_datasheet(options.ask, options.folder.name)}
        with TemporaryDirectory() as place:
            write_folder(Path(place) / "sheet", sheet)
            rig = _built(Path(place) / "sheet" / _DATASHEET)
    else:
        rig = load_rig_or_platform(options.rig) if options.datasheet is None else _built(options.datasheet)
    from .starter import starter_files

    bundled = None if options.ask or options.datasheet else options.rig
    return {**starter_files(rig, bundled), **sheet}


def _built(sheet: Path) -> Rig:
    """The rig of a datasheet; a three-stage valve is fitted to it, which takes half a minute."""
    datasheet = load_datasheet(sheet)
    from ...base.checkpoint import no_checkpoint
    from ..new_rig.study import rig_of

    return rig_of(datasheet, no_checkpoint, lambda text: print(text, file=sys.stderr, flush=True))[0]
