"""`jackbench new-rig DATASHEET.toml`: a rig from a maker's numbers."""

import argparse
from dataclasses import replace
from pathlib import Path

from ...rigs.datasheet import load_datasheet
from ...rigs.rig_file import rig_text
from ..common.options import computes, finish
from ..common.outcome import Outcome, Progress, Stage
from ..common.shipped import experiment


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("datasheet", type=experiment, help="a datasheet file, such as experiments/new_rig.toml")
    computes(parser, _new_rig, rig=False)


def _new_rig(options: argparse.Namespace, words: list[str]) -> None:
    sheet = load_datasheet(options.datasheet)
    from .study import identity, run_new_rig

    def study(stage: Stage, report_progress: Progress) -> Outcome:
        outcome, rig = run_new_rig(sheet, stage, report_progress)
        return replace(outcome, files={"rig.toml": rig_text(rig)})

    finish(options, words, Path(options.datasheet).stem, {"command": "new-rig", **identity(sheet)}, study)
