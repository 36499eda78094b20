"""`jackbench sheet-study RIG`: its arguments."""

import argparse
from functools import partial

from ...base.errors import InputError
from ...rigs.rig_file import load_rig
from ..common.options import computes, finish
from ..common.sheet_options import check_jack

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
