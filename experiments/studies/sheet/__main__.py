"""`python -m experiments.studies.sheet`: its arguments."""

import argparse
import sys
from collections.abc import Sequence
from functools import partial

from workbench.base.errors import InputError
from workbench.cli import script
from workbench.commands.common.options import computes, finish
from workbench.commands.common.sheet_options import check_jack
from workbench.rigs.rig_file import load_rig

SHEETS = ("valve", "records", "force")


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="a bundled rig or a rig file: rigs are drawn within its bounds")
    parser.add_argument(
        "--sheets", nargs="+", choices=SHEETS, default=SHEETS, help="sheets to draw rigs for (default: all)"
    )
    parser.add_argument("--number", type=int, default=200, metavar="N", help="rigs of each sheet (default: 200)")
    computes(parser, _sheet_study, rig=False)


def _sheet_study(options: argparse.Namespace, words: list[str]) -> None:
    if options.number < 1:
        raise InputError(f"--number {options.number}: must be 1 or more")
    rig = load_rig(options.rig)
    check_jack(rig)
    from .study import run_sheet_study

    sheets = tuple(dict.fromkeys(options.sheets))
    identity = {"command": "sheet-study", "rig": rig.table(), "sheets": list(sheets), "number": options.number}
    finish(options, words, "sheet-study", identity, partial(run_sheet_study, rig, sheets, options.number))


def main(words: Sequence[str] | None = None) -> int:
    """Run it; 2 where it is asked for what cannot be."""
    return script("experiments.studies.sheet", "Measure how often the lines of a sheet hold the truth.", options, words)


if __name__ == "__main__":
    sys.exit(main())
