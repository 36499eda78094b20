"""`jackbench new-rig DATASHEET.toml|SHEET.json`: a rig from a maker's numbers, or from a valve's own sheet."""

import argparse
from dataclasses import replace
from pathlib import Path

from ...base.errors import InputError
from ...rigs.datasheet import load_datasheet
from ...rigs.rig_file import load_rig, rig_text
from ..common.options import computes, finish
from ..common.outcome import Outcome, Progress, Stage
from ..common.sheet_options import read_lines
from ..common.shipped import experiment


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    what = "such as experiments/new_rig.toml, or metrics.json of valve-test"
    parser.add_argument("datasheet", type=experiment, help=what)
    parser.add_argument("--like", metavar="RIG", help="rig with the jack, load and supply around a sheet's valve")
    computes(parser, _new_rig, rig=False)


def _new_rig(options: argparse.Namespace, words: list[str]) -> None:
    if options.datasheet.suffix == ".json":
        _of_sheet(options, words)
        return
    if options.like is not None:
        raise InputError("--like belongs to a valve's sheet; a datasheet names its own rig under [valve] like")
    sheet = load_datasheet(options.datasheet)
    from .study import identity, run_new_rig

    def study(stage: Stage, report_progress: Progress) -> Outcome:
        outcome, rig = run_new_rig(sheet, stage, report_progress)
        return replace(outcome, files={"rig.toml": rig_text(rig)})

    finish(options, words, Path(options.datasheet).stem, {"command": "new-rig", **identity(sheet)}, study)


def _of_sheet(options: argparse.Namespace, words: list[str]) -> None:
    if options.like is None:
        raise InputError(f"{options.datasheet}: a sheet has a valve alone; name the rig around it with --like")
    like = load_rig(options.like)
    if not (like.is_jack and like.is_throttled):
        raise InputError(f"--like {options.like}: {like.name} has no servo-valve; name a rig with one")
    from .sheet import rig_of_sheet, run_sheet_rig

    rows = read_lines(options.datasheet)
    name = f"{like.name}-sheet"
    rig = rig_of_sheet(rows, like, name)

    def study(stage: Stage, report_progress: Progress) -> Outcome:
        return replace(run_sheet_rig(rows, rig, stage, report_progress), files={"rig.toml": rig_text(rig)})

    identity = {"command": "new-rig", "sheet": {id: dict(row) for id, row in rows.items()}, "like": like.table()}
    finish(options, words, name, identity, study)
