"""`jackbench new DIR`: a starter folder with a rig, experiments, a campaign and a controller."""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from ...base.errors import InputError
from ...rigs.datasheet import load_datasheet
from ...rigs.rig import Rig, load_rig
from .ask import STAGES, asked_datasheet

_DATASHEET = "datasheet.toml"


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="the folder to make")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--rig", default="jack-10t", help="a bundled rig or a rig file (default: jack-10t)")
    source.add_argument("--datasheet", type=Path, metavar="FILE", help="build the rig from a datasheet, as new-rig")
    source.add_argument("--ask", choices=STAGES, help="ask for the numbers of a valve's, jack's and load's datasheet")
    parser.set_defaults(call=_new)


def _new(options: argparse.Namespace, _words: list[str]) -> None:
    folder = options.folder
    if folder.exists():
        raise InputError(f"{folder}: exists already; choose another folder")
    if not folder.absolute().parent.is_dir():
        raise InputError(f"{folder}: no folder {folder.absolute().parent}; make it first")
    files = _files(options)
    _write(folder, files)
    print(f"{folder}: {', '.join(files)}\nnext: cd {folder}, and what README.md says")


def _files(options: argparse.Namespace) -> dict[str, str]:
    """The text of every file, by its path in the folder."""
    sheet: dict[str, str] = {}
    if options.ask is not None:
        sheet = {_DATASHEET: asked_datasheet(options.ask, options.folder.name)}
        with TemporaryDirectory() as place:
            _write(Path(place) / "sheet", sheet)
            rig = _built(Path(place) / "sheet" / _DATASHEET)
    else:
        rig = load_rig(options.rig) if options.datasheet is None else _built(options.datasheet)
    from .starter import starter_files

    bundled = None if options.ask or options.datasheet else options.rig
    return {**starter_files(rig, bundled), **sheet}


def _built(sheet: Path) -> Rig:
    """The rig of a datasheet; a three-stage valve is fitted to it, which takes half a minute."""
    datasheet = load_datasheet(sheet)
    from ...base.checkpoint import no_checkpoint
    from ..new_rig.study import rig_of

    return rig_of(datasheet, no_checkpoint, lambda text: print(text, file=sys.stderr, flush=True))[0]


def _write(folder: Path, files: Mapping[str, str]) -> None:
    """All of them, or none."""
    with TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.absolute().parent) as place:
        unfinished = Path(place) / "files"
        for name, text in files.items():
            path = unfinished / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        unfinished.rename(folder)
