"""Finished run folders: opened again, to be compared."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.files import read_json
from ...base.toml import read_toml


@dataclass(frozen=True)
class Finished:
    """A finished run: a name that no other has, its metrics, its configuration flattened, and its tables on disk."""

    name: str
    metrics: Mapping[str, Any]
    config: Mapping[str, Any]
    tables: Mapping[str, Path]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The rows of its metrics."""
        return list(self.metrics.get("rows", []))

    @property
    def controllers(self) -> list[str]:
        """Its controllers, longest name first: one name may begin another."""
        names = {row["controller"] for row in self.rows if isinstance(row.get("controller"), str)}
        return sorted(names, key=lambda name: (-len(name), name))

    def read(self, table: str) -> dict[str, np.ndarray]:
        """The columns of a table."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            read = pq.read_table(self.tables[table])
        except (OSError, pa.ArrowInvalid) as error:
            what = str(error).splitlines()[0]
            raise InputError(f"{self.tables[table]}: no readable Parquet table ({what}); run it again") from None
        return {name: read[name].to_numpy() for name in read.column_names}


def load(folders: Sequence[str | Path]) -> list[Finished]:
    """Open finished run folders. Raises InputError for one that is unfinished or not ours, and for fewer than two."""
    paths = [Path(folder).resolve() for folder in folders]
    if len(set(paths)) < 2 or len(set(paths)) < len(paths):
        raise InputError("compare: name two or more different run folders")
    return [_open(path, name) for path, name in zip(paths, _names(paths), strict=True)]


def fingerprint(runs: Sequence[Finished]) -> dict[str, str]:
    """What says that a comparison is the same one: names, and digests of the metrics."""
    return {run.name: sha256(json.dumps(run.metrics, sort_keys=True).encode()).hexdigest()[:16] for run in runs}


def _open(path: Path, name: str) -> Finished:
    if path.suffix == ".partial" or (not path.exists() and path.with_name(f"{path.name}.partial").exists()):
        raise InputError(f"{path}: is an unfinished run; finish it by the command that began it")
    if not path.is_dir():
        raise InputError(f"{path}: no such run folder; name a folder that jackbench left")
    for file in ("metrics.json", "config.toml"):
        if not (path / file).exists():
            raise InputError(f"{path}: is no run of jackbench (no {file}); name another")
    metrics, config = read_json(path / "metrics.json"), read_toml(path / "config.toml").values
    rows = metrics.get("rows", []) if isinstance(metrics, dict) else None
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError(f"{path / 'metrics.json'}: is not what jackbench writes; name another folder")
    return Finished(name, metrics, dict(_flat(config)), {file.stem: file for file in sorted(path.glob("*.parquet"))})


def _names(paths: Sequence[Path]) -> list[str]:
    """Folder names, with as many parents as it takes to tell them apart."""
    depth = 1
    while len(names := ["/".join(path.parts[-depth:]) for path in paths]) > len(set(names)):
        depth += 1
    return names


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping) and {"value", "unit"} <= value.keys():
            yield f"{above}{key}", f"{value['value']} {value['unit']}"
        elif isinstance(value, Mapping):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value
