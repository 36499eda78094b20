"""`jackbench show RIG`: every number of a rig, and what follows from them."""

import argparse
import json
from pathlib import Path
from typing import Any

from ...base.errors import InputError
from ...base.files import check_place
from ...rigs.platform import Platform, bundled_platforms, load_rig_or_platform
from ...rigs.platform.platform_file import platform_path
from ...rigs.rig import Rig
from ..common.options import prints
from .rig_file import rig_file


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="a bundled rig or a rig file")
    parser.add_argument("--toml", action="store_true", help="print the rig file, to start your own from")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the rig file, a .toml file")
    prints(parser, _show)


def _show(options: argparse.Namespace, _words: list[str]) -> None:
    rig = load_rig_or_platform(options.rig)
    if options.out is not None:
        _write(options.out, _text(options.rig, rig))
    elif options.toml:
        print(_text(options.rig, rig), end="")
    else:
        from .describe import describe_text

        table = _described(rig)
        print(json.dumps(table, indent=2) if options.json else describe_text(table))


def _text(name: str, rig: Rig | Platform) -> str:
    if not isinstance(rig, Platform):
        return rig_file(name, rig)
    return (platform_path(name) if name in bundled_platforms() else Path(name)).read_text("utf-8")


def _described(rig: Rig | Platform) -> dict[str, Any]:
    if isinstance(rig, Platform):
        from .platform import describe_platform

        return describe_platform(rig)
    from .describe import describe

    return describe(rig)


def _write(path: Path, text: str) -> None:
    if path.suffix != ".toml":
        raise InputError(f"--out {path}: name a .toml file")
    check_place(path, "--out")
    if path.exists():
        raise InputError(f"--out {path}: exists already; choose another")
    path.write_text(text, encoding="utf-8")
