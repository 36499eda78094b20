"""`jackbench trust FILE ...`."""

import argparse
from pathlib import Path

from ...base.errors import InputError
from ...base.trust import trust


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="Python files that `effect_files` names")
    parser.set_defaults(call=_trust)


def _trust(options: argparse.Namespace, _words: list[str]) -> None:
    for path in options.files:
        if path.suffix != ".py":
            raise InputError(f"{path}: no Python file; trust is given to the files that `effect_files` names")
    list_file = trust(*options.files)
    for path in options.files:
        print(f"{path}: trusted as it is now")
    print(f"remembered in {list_file}; delete its line there to take trust back")
