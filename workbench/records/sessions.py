"""Sessions of a campaign: records that were made on another day, with warmer oil, another supply."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from ..base.errors import echo
from ..base.table import Table
from ..base.units import Spec

_OIL = Spec("K", 233.15, 423.15, "temperature of the oil")


@dataclass(frozen=True)
class Session:
    """Records, by name, in which `numbers` of the rig may be others than in those of no session.

    `temperature`, K, is for the report alone.
    """

    name: str
    records: tuple[str, ...]
    numbers: tuple[str, ...] = ()
    temperature: float | None = None


def read_sessions(tables: Table, files: Mapping[str, str], train: Sequence[str]) -> tuple[Session, ...]:
    """The tables [sessions.NAME]; `files` are the files of the records that move, by name, `train` those fitted.

    Raises InputError for a bad key, a pattern that no record matches, a record of two sessions, and a number that no
    train record has as the rig's own.
    """
    sessions = tuple(_session(tables.table(name), name, files) for name in tables)
    for place, session in enumerate(sessions):
        table = tables.table(session.name)
        for other in sessions[:place]:
            if both := [name for name in session.records if name in other.records]:
                raise table.complaint("records", f"{both[0]} is also in session {other.name}; a record is in one")
        for number in session.numbers:
            inside = {name for each in sessions if number in each.numbers for name in each.records}
            if inside.issuperset(train):
                said = f"every train record is of a session with its own {number}; leave the first session out"
                raise table.complaint("numbers", f"{said}: its {number} is the rig's")
    return sessions


def _session(table: Table, name: str, files: Mapping[str, str]) -> Session:
    table.allow("records", "numbers", "temperature")
    patterns = table.words("records", "warm_*")
    for pattern in patterns:
        if not any(_matches(record, file, pattern) for record, file in files.items()):
            raise table.complaint("records", f"{echo(pattern)} is no record; there are {', '.join(files)}")
    records = tuple(record for record, file in files.items() if any(_matches(record, file, p) for p in patterns))
    temperature = table.quantity("temperature", _OIL) if "temperature" in table else None
    return Session(name, records, table.words("numbers", "K3", ()), temperature)


def _matches(record: str, file: str, pattern: str) -> bool:
    return fnmatchcase(record, pattern) or fnmatchcase(file, pattern)
