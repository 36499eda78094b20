"""`jackbench show RIG`: every number of a rig, and what follows from them."""

import argparse
import json
from pathlib import Path

from ...base.errors import InputError
from ...base.files import check_place
from ...rigs.rig_file import load_rig
from ..common.options import prints
from .rig_file import rig_file


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="a bundled rig or a rig file")
    parser.add_argument("--toml", action="store_true", help="print the rig file, to start your own from")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the rig file, a .toml file")
    prints(parser, _show)


def _show(options: argparse.Namespace, _words: list[str]) -> None:
    rig = load_rig(options.rig)
    if options.out is not None:
        _write(options.out, rig_file(options.rig, rig))
    elif options.toml:
        print(rig_file(options.rig, rig), end="")
    else:
        from .describe import describe, describe_text

        table = describe(rig)
        print(json.dumps(table, indent=2) if options.json else describe_text(table))


def _write(path: Path, text: str) -> None:
    if path.suffix != ".toml":
        raise InputError(f"--out {path}: name a .toml file")
    check_place(path, "--out")
    if path.exists():
        raise InputError(f"--out {path}: exists already; choose another")
    path.write_text(text, encoding="utf-8")
