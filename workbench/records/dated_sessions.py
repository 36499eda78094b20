"""A rig's recordings over months: a folder of dated campaigns, or one campaign whose [sessions.NAME] have dates."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

from ..base.errors import InputError, echo
from ..base.table import ConfigTable
from ..base.toml import read_toml
from ..base.units import Spec
from .campaign import FILE, Campaign, load_campaign
from .sessions import DATED

_DATE = re.compile(r"(?<!\d)(\d{4})[-_.]?(\d{2})[-_.]?(\d{2})(?!\d)")
_REPAIR = re.compile(
    r"\b(?:changed|change of|swapped|replac|repair|overhaul|serviced|exchang|refill|rebuil)"
    r"|\bnew (?:\w+[ -])?(?:oil|filter|seals?|valve|servo-?valve|pump|hoses?|accumulator|sensor|transducer|cell"
    r"|amplifier|card|cable|piston|rod|bearings?|spool|motor|coil|controller|cylinder|jack)\b"
    r"|\b(?:oil|filter|seal|valve|pump|hose) change\b",
    re.IGNORECASE,
)
_NOTHING = re.compile(
    r"\b(?:nothing|not|no|never|without|before|until|awaiting|to be)\b[^.;,]*"
    r"|\bchanged (?:the )?(?:operator|driver|shift|specimen|test|program)\w*"
    r"|\b(?:operator|driver|shift|specimen|test|program)\w* (?:was |has |were )?changed",
    re.IGNORECASE,
)
"""What is no repair though it has such a word."""
_OIL = Spec("K", 233.15, 423.15, "temperature of the oil")


@dataclass(frozen=True)
class DatedSession:
    """One session: its name, day, oil temperature [K], hours run and remark; `repair`: something was mended before it.

    `load` reads its records, all that move as train. Raises InputError.
    """

    name: str
    day: date
    temperature: float | None
    hours: float | None
    remark: str
    repair: bool
    load: Callable[[], Campaign]


@dataclass(frozen=True)
class DatedSessions:
    """All sessions of a folder by day, and a line for each that is left out."""

    folder: Path
    sessions: tuple[DatedSession, ...]
    left_out: tuple[str, ...]


def dated_sessions(folder: Path) -> DatedSessions:
    """The sessions of a folder. Raises InputError where there is none."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give one with a sub-folder a session, such as {folder}/2026-01-05")
    found, left_out = _of_one_campaign(folder) if (folder / FILE).exists() else _of_folders(folder)
    kept: list[DatedSession] = []
    for session in found:
        if same := [other.name for other in kept if other.day == session.day]:
            left_out.append(f"{session.name}: has the day of {same[0]}, {session.day}; one session a day is read")
        else:
            kept.append(session)
    if not kept:
        why = f": {left_out[0]}" if left_out else "; name its sub-folders by date, or give each campaign.toml a date"
        raise InputError(f"{folder}: no dated session{why}")
    if [session.day for session in kept] != sorted(session.day for session in kept):
        left_out.append("the folders are not in the order of their dates; the dates decide")
    return DatedSessions(folder, tuple(sorted(kept, key=lambda session: session.day)), tuple(left_out))


def _of_folders(folder: Path) -> tuple[list[DatedSession], list[str]]:
    found, left_out = [], []
    for file in sorted(folder.glob(f"*/{FILE}")):
        name = file.parent.name
        try:
            document = read_toml(file)
            table = document.table("session", *DATED) if "session" in document else document
            found.append(_session(name, table, lambda own=file.parent: _moving(load_campaign(own, judged=False))))
        except InputError as error:
            left_out.append(f"{name}: {error}")
    return found, left_out


def _of_one_campaign(folder: Path) -> tuple[list[DatedSession], list[str]]:
    campaign, found, left_out = load_campaign(folder), [], []
    tables = read_toml(folder / FILE).optional_table("sessions")
    for session in campaign.sessions:
        try:
            table = tables.table(session.name)
            found.append(_session(session.name, table, lambda own=session.records: _only(campaign, own)))
        except InputError as error:
            left_out.append(f"{session.name}: {error}")
    return found, left_out


def _session(name: str, table: ConfigTable, load: Callable[[], Campaign]) -> DatedSession:
    remark = table.text("remark", "")
    key = "oil_temperature" if "oil_temperature" in table else "temperature"
    return DatedSession(
        name,
        _day(name, table),
        table.quantity(key, _OIL) if key in table else None,
        table.number("hours", 0.0) if "hours" in table else None,
        remark,
        table.flag("repair", bool(_REPAIR.search(_NOTHING.sub("", remark)))),
        load,
    )


def _day(name: str, table: ConfigTable) -> date:
    written = str(table.values.get("date", "")) or name
    match = _DATE.search(written)
    try:
        return date(*map(int, match.groups())) if match else date.fromisoformat(written)
    except ValueError:
        raise InputError(f'{echo(written)} is no date; write date = "2026-01-05", or name the folder so') from None


def _only(campaign: Campaign, names: Sequence[str]) -> Campaign:
    roles = {
        role: tuple(r for r in getattr(campaign, role) if r.name in names) for role in ("train", "select", "heldout")
    }
    return _moving(replace(campaign, **roles, sessions=(), drifts=()))


def _moving(campaign: Campaign) -> Campaign:
    """With all records that move under train: a watch holds none out, since the next session is the test."""
    moving = (*campaign.train, *campaign.select, *campaign.heldout)
    if not moving:
        raise InputError(f"{campaign.path}: no record of this session moves")
    return replace(campaign, train=moving, select=(), heldout=campaign.heldout or moving)
