"""Campaign folders: which records of one rig measure the noise, are fitted, choose between models, only judge."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from hashlib import sha256
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError, echo, nearest
from ..base.files import read_bytes
from ..base.signals import FURTHER_INPUTS, MEASURED, SIGNALS
from ..base.table import ConfigTable
from ..base.toml import read_toml
from ..base.units import Spec
from .columns import HELD, LINEAR, ColumnMap
from .described import described
from .frequency_sheet import FrequencySheet, listed_sheet
from .read import read_record, record_name
from .record import Record, centred_means
from .sessions import DATED, DeclaredSession, Drift, read_drifts, read_sessions

FILE = "campaign.toml"
_APART = {"select": "what selects is not fitted", "heldout": "a held-out record is never fitted nor selected by"}
_KEYS = (
    "rig",
    "corrector",
    "records",
    "signals",
    "unused",
    "mean",
    "sheets",
    "score",
    "session",
    "sessions",
    "drifts",
    "late",
    *DATED,
)
ROLES = ("static", "train", "select", "heldout")
WINDOWS, FREE_RUN = "windows", "free-run"


@dataclass(frozen=True)
class InputNoise:
    """Noise of a measured input: white noise of sigma (SI), and the weights of rows that follow one another in what is
    held."""

    sigma: float
    weights: tuple[float, ...] = (1.0,)


@dataclass(frozen=True)
class Campaign:
    """Records of one rig: `rig` is a bundled rig's name or a rig file's full path; all but heldout may be empty.

    `select` are records that choose between models; without any, parts of the train records do so in turn. `score` is
    what is fitted and quoted: errors in short "windows", or of one "free-run" through each record. In the records of
    `sessions` some of the rig's numbers may be others, over those of `drifts` they may drift. `corrector`: the one of
    the rig's valve that the recorded command drives; empty: the rig's own. `input_noise`: that of inputs which were
    measured, by name; others are known.
    """

    path: Path
    rig: str
    static: tuple[Record, ...]
    train: tuple[Record, ...]
    heldout: tuple[Record, ...]
    select: tuple[Record, ...] = ()
    sheets: tuple[FrequencySheet, ...] = ()
    score: str = WINDOWS
    sessions: tuple[DeclaredSession, ...] = ()
    drifts: tuple[Drift, ...] = ()
    corrector: str = ""
    input_noise: Mapping[str, InputNoise] = field(default_factory=dict)

    @property
    def records(self) -> tuple[Record, ...]:
        """All of them, role by role."""
        return tuple(record for role in ROLES for record in getattr(self, role))

    def session_of(self, record: str) -> str | None:
        """The session of a record; None of one in no session."""
        return next((session.name for session in self.sessions if record in session.records), None)


@dataclass(frozen=True)
class _Entry:
    """A record as the campaign lists it: a file, or the part of it with start <= t < stop in s. `constants` [SI] are
    inputs that were set to one value all through it."""

    file: str
    start: float | None = None
    stop: float | None = None
    constants: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        name = (Path(self.file).parent / record_name(Path(self.file))).as_posix()
        if self.is_whole:
            return name
        return (
            f"{name} {0 if self.start is None else self.start:g}-{'end' if self.stop is None else f'{self.stop:g} s'}"
        )

    @property
    def is_whole(self) -> bool:
        return self.start is None and self.stop is None

    def overlaps(self, other: "_Entry") -> bool:
        return Path(self.file) == Path(other.file) and self.meets(other)

    def meets(self, other: "_Entry") -> bool:
        """Whether they have times in common."""
        low = max(-math.inf if entry.start is None else entry.start for entry in (self, other))
        high = min(math.inf if entry.stop is None else entry.stop for entry in (self, other))
        return low < high


def load_campaign(folder: str | Path, leg: int | None = None, judged: bool = True) -> Campaign:
    """Read a campaign folder.

    Parameters
    ----------
    folder
        The folder, or the campaign.toml in it.
    leg
        Of a platform, the leg whose records are read, counted from 1: columns are called after it, `leg3.pa [bar]`.
    judged
        Whether a held-out record must be there.

    Returns
    -------
    The campaign.

    Raises
    ------
    InputError
        For a bad file, key, record or session, a missing held-out record, one that is also fitted, and a mapped column
        that no record has.
    """
    file = _file(folder)
    top = read_toml(described(file)).allow(*_KEYS)
    rig = _rig(top, file.parent)
    score = top.word("score", (WINDOWS, FREE_RUN), WINDOWS)
    signals = top.optional_table("signals")
    mapping = {name: _mapped(signals.table(name), name) for name in signals.allow(*SIGNALS)}
    columns = mapping if leg is None else _leg_columns(leg)
    reading = _Reading(file.parent, columns, frozenset(top.words("unused", "current", ())), _mean(top), _late(top))
    listed = top.optional_table("records", *ROLES)
    entries = _entries(listed, judged)
    _check_copies(listed, entries, file.parent)
    records = {role: tuple(reading.record(entry) for entry in entries[role]) for role in ROLES}
    _check_mapped(signals, mapping, [record for group in records.values() for record in group])
    _check_alike(listed, entries, records)
    sheets = tuple(listed_sheet(entry, file.parent) for entry in top.tables("sheets"))
    files = {entry.name: entry.file for role in ROLES[1:] for entry in entries[role]}
    sessions = read_sessions(top.optional_table("sessions"), files, [entry.name for entry in entries["train"]])
    drifts = read_drifts(top.optional_table("drifts"), files)
    return Campaign(
        file.parent,
        rig,
        static=records["static"],
        train=records["train"],
        select=records["select"],
        heldout=records["heldout"],
        sheets=sheets,
        score=score,
        sessions=sessions,
        drifts=drifts,
        corrector=top.text("corrector", ""),
    )


def _leg_columns(leg: int) -> dict[str, ColumnMap]:
    """The columns of the signals of a platform's leg."""
    return {name: ColumnMap(f"leg{leg}.{name}") for name in SIGNALS if name != "t"}


def campaign_rig(folder: str | Path) -> str:
    """The rig that a campaign names, without its records: a bundled one, or a file. Raises InputError."""
    file = _file(folder)
    return _rig(read_toml(described(file)), file.parent)


def _file(folder: str | Path) -> Path:
    path = Path(folder)
    return path / FILE if path.is_dir() else path


def judged_by(campaign: Campaign, patterns: Sequence[str]) -> Campaign:
    """The campaign with the records whose names match a pattern such as "*_5V_*" held out, and the others fitted.

    What the campaign has under static and select stays. Raises InputError where a pattern matches none, or all do.
    """
    moving = (*campaign.train, *campaign.heldout)
    for pattern in patterns:
        if not any(fnmatchcase(record.name, pattern) for record in moving):
            known = ", ".join(record.name for record in moving)
            raise InputError(f"--heldout {echo(pattern)}: no record is called that; there are {known}")
    judging = [any(fnmatchcase(record.name, pattern) for pattern in patterns) for record in moving]
    if all(judging):
        raise InputError("--heldout: every record is held out, so nothing can be fitted; leave some")
    train, heldout = (
        tuple(record for record, judges in zip(moving, judging, strict=True) if judges is role)
        for role in (False, True)
    )
    return replace(campaign, train=train, heldout=heldout)


@dataclass(frozen=True)
class _Reading:
    """How records are read: columns, signals left out, the time [s] over which rows are averaged, and how late [s]
    commands act after their rows."""

    folder: Path
    mapping: Mapping[str, ColumnMap]
    unused: frozenset[str]
    mean: float | None
    late: float

    def record(self, entry: _Entry) -> Record:
        """A record with its constants as signals."""
        record = read_record(self.folder / entry.file, self.mapping, entry.start, entry.stop, self.unused)
        constants = {name: np.full(record.t.size, value) for name, value in entry.constants}
        record = replace(record, name=entry.name, signals={**record.signals, **constants}, late=self.late)
        rows = 1 if self.mean is None else round(self.mean / record.period)
        return record if rows <= 1 else centred_means(record, rows)


def _late(top: ConfigTable) -> float:
    """How late commands act after the rows that log them, where these were sampled before."""
    return (
        top.quantity("late", Spec("s", 0.0, 1.0, "time from a row to its command's effect")) if "late" in top else 0.0
    )


def _mean(top: ConfigTable) -> float | None:
    return top.quantity("mean", Spec("s", 1e-6, 1e3, "time over which rows are averaged")) if "mean" in top else None


def _rig(top: ConfigTable, folder: Path) -> str:
    return str(top.path("rig", folder, ".toml")) if top.text("rig").endswith(".toml") else top.text("rig")


def _mapped(table: ConfigTable, name: str) -> ColumnMap:
    if name == "t" and "period" in table:
        table.allow("period")
        return ColumnMap(period=table.quantity("period", Spec("s", 1e-6, 1e3, "time from row to row")))
    table.allow("column", "unit", "scale", "clip", "to", "offset", "between")
    between = table.word("between", (HELD, LINEAR), HELD) if "between" in table else None
    column, unit, to = (table.text(key) if key in table else None for key in ("column", "unit", "to"))
    scale = table.number("scale") if "scale" in table else None
    if scale == 0.0:
        raise table.complaint("scale", "is 0; give the factor of the column")
    offset = table.number("offset") if "offset" in table else 0.0
    return ColumnMap(column, unit, scale, _clip(table) if "clip" in table else None, to, offset, between=between)


def _clip(table: ConfigTable) -> tuple[float, float]:
    clip = table.numbers("clip", "[low, high]")
    if len(clip) != 2 or not clip[0] < clip[1]:
        raise table.complaint("clip", "must be [low, high] in the column's unit")
    return clip[0], clip[1]


def _entries(records: ConfigTable, judged: bool) -> dict[str, list[_Entry]]:
    entries = {role: _listed(records, role) for role in ROLES}
    if judged and not entries["heldout"]:
        raise records.complaint("heldout", 'none; keep one record from the fit: heldout = ["..."]')
    moving = [(role, entry) for role in ROLES[1:] for entry in entries[role]]
    for (first, used), (second, entry) in combinations(moving, 2):
        if first != second and used.overlaps(entry):
            raise records.complaint(second, f"{entry.file} is also in {first}; {_APART[second]}")
    return entries


def _check_copies(records: ConfigTable, entries: Mapping[str, list[_Entry]], folder: Path) -> None:
    """Raises InputError for samples that are there again under another name or in another role: repeats that differ by
    nothing make the noise floor 0. A part of a record that moves may be the rest."""
    files = [(role, entry, _content(folder / entry.file)) for role in entries for entry in entries[role]]
    for (role, entry, content), (again, copy, copied) in combinations(files, 2):
        part_at_rest = role == "static" != again and not entry.is_whole
        if content == copied and entry.meets(copy) and not part_at_rest:
            raise records.complaint(again, f"{copy.file} has the samples of {entry.file} in {role}; list them once")


def _check_alike(
    listed: ConfigTable, entries: Mapping[str, list[_Entry]], records: Mapping[str, Sequence[Record]]
) -> None:
    """Raises InputError for moving records of two files that have the same samples, whatever their format."""
    moving = [
        (role, entry.file, record)
        for role in ROLES[1:]
        for entry, record in zip(entries[role], records[role], strict=True)
    ]
    for (role, file, record), (again, copy, other) in combinations(moving, 2):
        if file != copy and _same_samples(record, other):
            raise listed.complaint(again, f"{copy} has the samples of {file} in {role}; list them once")


def _same_samples(record: Record, other: Record) -> bool:
    """Whether two records agree in every signal that both measured, to the rounding of their formats."""
    shared = [name for name in record.names if name in other.signals and name in MEASURED]
    if record.t.size != other.t.size or not shared or not np.allclose(record.t, other.t, rtol=1e-9, atol=1e-9):
        return False
    pairs = ((record.signals[name], other.signals[name]) for name in shared)
    return all(np.allclose(a, b, rtol=0.0, atol=1e-7 * (np.ptp(a) + np.finfo(float).tiny)) for a, b in pairs)


def _content(path: Path) -> str:
    """What says that files have the same samples: a digest, unpacked."""
    return sha256(read_bytes(path, kind="record")).hexdigest()


def _listed(records: ConfigTable, role: str) -> list[_Entry]:
    """A role's files, or parts of them."""
    items = records.values.get(role, [])
    if not isinstance(items, list):
        raise records.complaint(role, 'must be a list of files; write ["steps.csv"]')
    entries = [_entry(records, role, item) for item in items]
    for index, entry in enumerate(entries):
        if any(entry.overlaps(other) for other in entries[:index]):
            raise records.complaint(role, f"{entry.file} is listed twice; remove one")
    return entries


def _entry(records: ConfigTable, role: str, item: Any) -> _Entry:
    if isinstance(item, str) and item:
        return _Entry(item)
    if not isinstance(item, Mapping):
        hint = 'write "a.csv" or {file = "a.csv", from = 0.0, to = 0.1}'
        raise records.complaint(role, f"{echo(item)} is no record; {hint}")
    place = records.place.inside(role, records.values[role].index(item))
    part = ConfigTable(item, place, "file", "from", "to", *FURTHER_INPUTS)
    file = part.text("file")
    start, stop = (part.number(key) if key in part else None for key in ("from", "to"))
    if start is not None and stop is not None and not start < stop:
        raise part.complaint("from", f"{file} from {start:g} to {stop:g} s is empty; swap them")
    given = [name for name in FURTHER_INPUTS if name in part]
    constants = ((name, part.quantity(name, Spec(SIGNALS[name].si, -math.inf, math.inf, ""))) for name in given)
    return _Entry(file, start, stop, tuple(constants))


def _check_mapped(signals: ConfigTable, mapping: Mapping[str, ColumnMap], records: list[Record]) -> None:
    present = {name for record in records for name in ("t", *record.names)}
    for name, mapped in mapping.items():
        if name not in present:
            raise signals.complaint(
                name, f"no record has a column {echo(mapped.column or name)}; {nearest(name, present)}"
            )
