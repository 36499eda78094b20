"""`jackbench new DIR`: a starter folder with a rig, experiments, a campaign and a controller."""

import argparse
import sys
import tomllib
from pathlib import Path

from ...base.table import ConfigTable
from ...rigs.datasheet import Datasheet, load_datasheet, read_datasheet
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
    from .starter import starter_files

    if options.ask is not None:
        text, files = asked_datasheet(
            options.ask, options.folder.name, lambda text: starter_files(_answered(text), None)
        )
        return {**files, _DATASHEET: text}
    if options.datasheet is not None:
        return starter_files(_built(load_datasheet(options.datasheet)), None)
    return starter_files(load_rig_or_platform(options.rig), options.rig)


def _answered(text: str) -> Rig:
    """The rig of a datasheet that is not written yet."""
    return _built(read_datasheet(ConfigTable(tomllib.loads(text), "the answers"), Path(), _DATASHEET))


def _built(sheet: Datasheet) -> Rig:
    """The rig of a datasheet; a three-stage valve is fitted to it, which takes half a minute."""
    from ...base.checkpoint import no_checkpoint
    from ..new_rig.study import rig_of

    return rig_of(sheet, no_checkpoint, lambda text: print(text, file=sys.stderr, flush=True))[0]
