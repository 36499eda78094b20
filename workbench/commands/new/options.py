"""`jackbench new DIR`: a starter folder with a rig, experiments, a campaign and a controller."""

import argparse
from pathlib import Path

from ...base.errors import InputError
from ...rigs.rig import load_rig


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="the folder to make")
    parser.add_argument("--rig", default="jack-10t", help="a bundled rig or a rig file (default: jack-10t)")
    parser.set_defaults(call=_new)


def _new(options: argparse.Namespace, _words: list[str]) -> None:
    folder = options.folder
    if folder.exists():
        raise InputError(f"{folder}: exists already; choose another folder")
    if not folder.absolute().parent.is_dir():
        raise InputError(f"{folder}: no folder {folder.absolute().parent}; make it first")
    rig = load_rig(options.rig)
    from .starter import starter_files

    files = starter_files(rig, options.rig)
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    print(f"{folder}: {', '.join(files)}\nnext: cd {folder}, and what README.md says")
