"""Commands that also leave a rig: in the run folder as rig.toml, and where --rig-out says."""

import argparse
from pathlib import Path
from typing import Any

from ...base.errors import InputError
from ...base.files import check_place, write_whole
from .options import Call, Study, computes, finish
from .outcome import Outcome, Progress, Stage


def leaves_rig(command: argparse.ArgumentParser, call: Call) -> None:
    """Options of a command that computes, and leaves a rig."""
    command.add_argument("--rig-out", type=Path, metavar="FILE", help="also write the found rig into this .toml file")
    computes(command, call)


def finish_with_rig(
    options: argparse.Namespace, words: list[str], source: str, identity: dict[str, Any], study: Study
) -> None:
    """Finish a study that leaves a rig.toml, which --rig-out is a copy of, written before any page is drawn; `source`
    names what it is of."""
    out = options.rig_out
    if out is not None:
        if out.suffix != ".toml":
            raise InputError(f"--rig-out {out}: name a .toml file")
        check_place(out, "--rig-out")
        if out.exists() and not options.force:
            raise InputError(f"--rig-out {out}: exists already; choose another or add --force to replace it")

    def study_and_rig(stage: Stage, progress: Progress) -> Outcome:
        outcome = study(stage, progress)
        if out is not None:
            write_whole(out, str(outcome.files["rig.toml"]))
        return outcome

    finish(options, words, f"{identity['command']}-{source}", identity, study_and_rig)
