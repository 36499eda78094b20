"""Sessions of a campaign: records of another day, with warmer oil; and drifts, from one record to the next."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from ..base.errors import echo
from ..base.table import ConfigTable
from ..base.units import Spec

RECORD, REPEAT = PER = "record", "repeat"
DATED = ("date", "oil_temperature", "hours", "remark", "repair")  # of sessions over months: see dated_sessions
_OIL = Spec("K", 233.15, 423.15, "temperature of the oil")


@dataclass(frozen=True)
class DeclaredSession:
    """Records, by name, in which `numbers` of the rig may be others than in those of no session.

    `temperature`, K, is for the report alone.
    """

    name: str
    records: tuple[str, ...]
    numbers: tuple[str, ...] = ()
    temperature: float | None = None


@dataclass(frozen=True)
class Drift:
    """Records, by name and in order, over which `numbers` of the rig drift: with each further one of them ("record"),
    or with each further one of the same command ("repeat")."""

    name: str
    records: tuple[str, ...]
    numbers: tuple[str, ...]
    per: str


def read_sessions(tables: ConfigTable, files: Mapping[str, str], train: Sequence[str]) -> tuple[DeclaredSession, ...]:
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
                said = f"every train record belongs to a session with its own {number}; leave the first session out"
                raise table.complaint("numbers", f"{said}: its {number} is the rig's")
    return sessions


def read_drifts(tables: ConfigTable, files: Mapping[str, str]) -> tuple[Drift, ...]:
    """The tables [drifts.NAME]; records in the order of the patterns. Raises InputError for a bad key or pattern."""
    drifts = []
    for name in tables:
        table = tables.table(name, "records", "numbers", "per")
        records = _records(table, files)
        drifts.append(Drift(name, records, table.words("numbers", "K3"), table.word("per", PER)))
    return tuple(drifts)


def _session(table: ConfigTable, name: str, files: Mapping[str, str]) -> DeclaredSession:
    table.allow("records", "numbers", "temperature", *DATED)
    temperature = table.quantity("temperature", _OIL) if "temperature" in table else None
    return DeclaredSession(name, _records(table, files), table.words("numbers", "K3", ()), temperature)


def _records(table: ConfigTable, files: Mapping[str, str]) -> tuple[str, ...]:
    """The records that match a pattern, pattern by pattern."""
    patterns = table.words("records", "warm_*")
    for pattern in patterns:
        if not any(_matches(record, file, pattern) for record, file in files.items()):
            raise table.complaint("records", f"{echo(pattern)} is no record; there are {', '.join(files)}")
    matching = (name for pattern in patterns for name, file in files.items() if _matches(name, file, pattern))
    return tuple(dict.fromkeys(matching))


def _matches(record: str, file: str, pattern: str) -> bool:
    return fnmatchcase(record, pattern) or fnmatchcase(file, pattern)
