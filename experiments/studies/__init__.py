"""How often jackbench's answers are right, where the truth is known. They run from the root of the repository.

python -m experiments.studies.trace         traces of drawn campaigns
python -m experiments.studies.watch         watches over drawn rigs that wear
python -m experiments.studies.commission    hidden rigs, commissioned behind the wire
python -m experiments.studies.sheet         intervals of sheets of drawn rigs
python -m experiments.studies.closed_loop   numbers of hidden loops, from reference and position
python -m experiments.studies.knowledge     what controllers gain when a rig's numbers are known better

Beside each lies what it left, NAME.json: the version and date that made it, the command, and its rows.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Kept:
    """What a study left: its table by name, the version of jackbench that made it, on which day, by which command."""

    version: str
    date: str
    command: str
    table: dict[str, Any]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """One of each case."""
        return self.table["rows"]


def kept(name: str) -> Kept:
    """The table that STUDY/NAME.json holds, of a name "STUDY/NAME"."""
    table = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return Kept(table.pop("version"), table.pop("date"), table.pop("command"), table)
