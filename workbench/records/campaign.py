"""Campaign folders: which records of one rig measure the noise, which are fitted, which only judge."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from ..base.errors import InputError, nearest
from ..base.toml import check_keys, read_toml
from .columns import ColumnMap, check_signal
from .frequency_sheet import FrequencySheet, listed_sheets
from .read import read_record, record_name
from .record import Record

FILE = "campaign.toml"
ROLES = ("static", "train", "heldout")


@dataclass(frozen=True)
class Campaign:
    """Records of one rig: `rig` is a bundled rig's name or a rig file's full path; static and train may be empty."""

    path: Path
    rig: str
    static: tuple[Record, ...]
    train: tuple[Record, ...]
    heldout: tuple[Record, ...]
    sheets: tuple[FrequencySheet, ...] = ()


@dataclass(frozen=True)
class _Entry:
    """A record as the campaign lists it: a file, or the part of it with start <= t < stop in s."""

    file: str
    start: float | None = None
    stop: float | None = None

    @property
    def name(self) -> str:
        name = (Path(self.file).parent / record_name(Path(self.file))).as_posix()
        if self.start is None and self.stop is None:
            return name
        return (
            f"{name} {0 if self.start is None else self.start:g}-{'end' if self.stop is None else f'{self.stop:g} s'}"
        )

    def overlaps(self, other: "_Entry") -> bool:
        low = max(-math.inf if entry.start is None else entry.start for entry in (self, other))
        high = min(math.inf if entry.stop is None else entry.stop for entry in (self, other))
        return Path(self.file) == Path(other.file) and low < high


def load_campaign(folder: str | Path) -> Campaign:
    """Read a campaign folder, or the campaign.toml in it.

    Raises InputError for a bad file, key or record, for no heldout record, for one that is also fitted, and for a
    mapped column that no record has.
    """
    file = Path(folder)
    file = file / FILE if file.is_dir() else file
    table = read_toml(file)
    check_keys(table, ("rig", "records", "signals", "sheets"), str(file))
    rig = _rig(file, table)
    mapping = _mapping(file, table)
    entries = _entries(file, table)
    records = {role: tuple(_record(file.parent, entry, mapping) for entry in entries[role]) for role in ROLES}
    _check_mapped(file, mapping, [record for group in records.values() for record in group])
    return Campaign(file.parent, rig, **records, sheets=listed_sheets(file, table.get("sheets", [])))


def _record(folder: Path, entry: _Entry, mapping: Mapping[str, ColumnMap]) -> Record:
    return replace(read_record(folder / entry.file, mapping, entry.start, entry.stop), name=entry.name)


def _rig(file: Path, table: Mapping[str, Any]) -> str:
    rig = table.get("rig")
    if not isinstance(rig, str) or not rig:
        raise InputError(f'{file}: rig: missing; write rig = "jack-10t" or the path of a rig file')
    if not rig.endswith(".toml"):
        return rig
    beside = (file.parent / rig).resolve()
    if not beside.is_file():
        raise InputError(f"{file}: rig: no such file as {rig} beside the campaign; check the path")
    return str(beside)


def _mapping(file: Path, table: Mapping[str, Any]) -> dict[str, ColumnMap]:
    mapping = {}
    for name, value in _table(file, table, "signals").items():
        where = f"{file}: [signals] {name}"
        check_signal(name, f"{file}: [signals]")
        if not isinstance(value, dict):
            raise InputError(f'{where}: not a table; write {name} = {{column = "...", unit = "..."}}')
        check_keys(value, ("column", "unit", "scale", "clip"), where)
        for key in ("column", "unit"):
            if key in value and not isinstance(value[key], str):
                raise InputError(f'{where}: {key} must be text; write {key} = "..."')
        scale = _number(value.get("scale"), f"{where}: scale")
        if scale == 0.0:
            raise InputError(f"{where}: scale is 0; give the factor of the column")
        mapping[name] = ColumnMap(value.get("column"), value.get("unit"), scale, _clip(value.get("clip"), where))
    return mapping


def _clip(value: Any, where: str) -> tuple[float, float] | None:
    if value is None:
        return None
    limits = [_number(item, f"{where}: clip") for item in value] if isinstance(value, list) else []
    if len(limits) != 2 or limits[0] is None or limits[1] is None or not limits[0] < limits[1]:
        raise InputError(f"{where}: clip must be [low, high] in the column's unit")
    return limits[0], limits[1]


def _number(value: Any, where: str) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{where}: must be a number, not {value!r}")
    return float(value)


def _entries(file: Path, table: Mapping[str, Any]) -> dict[str, list[_Entry]]:
    records = _table(file, table, "records")
    check_keys(records, ROLES, f"{file}: [records]")
    entries = {role: _listed(records.get(role, []), f"{file}: [records] {role}") for role in ROLES}
    if not entries["heldout"]:
        raise InputError(f'{file}: [records] heldout: none; keep one record from the fit: heldout = ["..."]')
    for fitted, judged in product(entries["train"], entries["heldout"]):
        if fitted.overlaps(judged):
            raise InputError(
                f"{file}: [records] heldout: {judged.file} is also in train; a held-out record is never fitted"
            )
    return entries


def _listed(value: Any, where: str) -> list[_Entry]:
    if not isinstance(value, list):
        raise InputError(f'{where}: must be a list of files; write ["steps.csv"]')
    entries = [_entry(item, where) for item in value]
    for index, entry in enumerate(entries):
        if entry in entries[:index]:
            raise InputError(f"{where}: {entry.file} is listed twice; remove one")
    return entries


def _entry(item: Any, where: str) -> _Entry:
    if isinstance(item, str) and item:
        return _Entry(item)
    if not isinstance(item, dict) or not isinstance(item.get("file"), str):
        raise InputError(f'{where}: {item!r} is no record; write "a.csv" or {{file = "a.csv", from = 0.0, to = 0.1}}')
    check_keys(item, ("file", "from", "to"), where)
    start = _number(item.get("from"), f"{where}: {item['file']}: from")
    stop = _number(item.get("to"), f"{where}: {item['file']}: to")
    if start is not None and stop is not None and not start < stop:
        raise InputError(f"{where}: {item['file']}: from {start:g} to {stop:g} s is empty; swap them")
    return _Entry(item["file"], start, stop)


def _table(file: Path, table: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise InputError(f"{file}: {key}: must be a table; write [{key}]")
    return value


def _check_mapped(file: Path, mapping: Mapping[str, ColumnMap], records: list[Record]) -> None:
    present = {name for record in records for name in ("t", *record.names)}
    for name, mapped in mapping.items():
        if name not in present:
            where = f"{file}: [signals] {name}"
            raise InputError(f'{where}: no record has a column "{mapped.column or name}"; {nearest(name, present)}')
