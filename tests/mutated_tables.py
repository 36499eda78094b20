"""Seeded mutations of tables of numbers: records as CSV, Parquet and MAT files, and frequency-response sheets."""

import gzip
import io
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from random import Random
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from mutants import LONG, NUMBERS, UNITS, mutated_bytes
from scipy.io import savemat

ROWS = 40
CELLS = (
    "",
    " ",
    "nan",
    "-NaN",
    "n/a",
    "inf",
    "-inf",
    "1e400",
    "abc",
    "1_000",
    "0x10",
    "1,5",
    '"1"',
    '"',
    "1;2",
    "é",
    LONG,
)
SHEET = {
    "frequency [Hz]": [1.0, 2.0, 5.0, 10.0, 20.0, 50.0],
    "gain [dB]": [0.0, -0.1, -0.4, -1.5, -4.0, -11.0],
    "phase [deg]": [-3.0, -6.0, -15.0, -31.0, -58.0, -110.0],
    "amplitude [1]": [0.1] * 6,
}

Columns = list[tuple[str, list[Any]]]


def record_columns(random: Random) -> Columns:
    """A small record as header cells and numbers, as the bundled sample has them."""
    t = np.round(np.arange(ROWS) * 1e-3, 6)
    wave = np.sin(40 * t + random.random())
    columns = {
        "t [s]": t,
        "command [1]": 0.1 * wave,
        "pa [bar]": 109 + 3 * wave + 0.1 * np.cos(900 * t),
        "pb [bar]": 109 - 3 * wave,
        "position [mm]": 2 * np.cos(40 * t),
    }
    return [(cell, values.tolist()) for cell, values in columns.items()]


def mutated_columns(columns: Columns, random: Random) -> Columns:
    """The table with one to three changes of its header or its columns."""
    for _ in range(random.choice((1, 1, 2, 3))):
        columns = random.choice(_CHANGES)(list(columns), random)
    return columns


def csv_bytes(columns: Columns, random: Random) -> bytes:
    """The table as text, sometimes with cells and lines that do not belong there."""
    length = max((len(values) for _, values in columns), default=0)
    rows = [[cell for cell, _ in columns]]
    rows += [[str(values[i]) if i < len(values) else "" for _, values in columns] for i in range(length)]
    for _ in range(random.choice((0, 0, 1, 2))):
        _spoil(random.choice(rows), random)
    separator = random.choice((",",) * 12 + (";", "\t", ", "))
    raw = "\n".join(separator.join(row) for row in rows).encode()
    return mutated_bytes(raw, random) if random.random() < 0.2 else raw


def write_csv(path: Path, random: Random, columns: Columns) -> Path:
    """A mutated CSV file, packed or not."""
    raw = csv_bytes(mutated_columns(columns, random), random)
    if random.random() < 0.2:
        path, raw = path.with_suffix(".csv.gz"), gzip.compress(raw, 1)
        raw = mutated_bytes(raw, random) if random.random() < 0.4 else raw
    path.write_bytes(raw)
    return path


def write_parquet(path: Path, random: Random) -> Path:
    """A mutated Parquet file: other types, no rows, names twice, broken bytes."""
    arrays, names = [], []
    columns = mutated_columns(record_columns(random), random)
    length = min((len(values) for _, values in columns), default=0)
    for cell, values in columns:
        numbers = _numbers(values[:length])
        arrays.append(random.choice(_ARROW)(numbers) if random.random() < 0.1 else pa.array(numbers))
        names.append(cell)
    buffer = io.BytesIO()
    pq.write_table(pa.Table.from_arrays(arrays, names=names), buffer)
    raw = buffer.getvalue()
    path.write_bytes(mutated_bytes(raw, random) if random.random() < 0.2 else raw)
    return path


def write_mat(path: Path, random: Random) -> Path:
    """A mutated MAT file of version 5 or 7.3."""
    columns = mutated_columns(record_columns(random), random)
    variables = {cell.split(" [")[0] or "x": _numbers(values) for cell, values in columns}
    for name in variables:
        if random.random() < 0.1:
            variables[name] = random.choice(_MATLAB)(variables[name])
    if random.random() < 0.5:
        _write_hdf5(path, variables)
    else:
        named = {name[:31]: value for name, value in variables.items() if name.isidentifier() and name.isascii()}
        savemat(path, named, do_compression=random.random() < 0.3)
    if random.random() < 0.2:
        path.write_bytes(mutated_bytes(path.read_bytes(), random))
    return path


def sheet_columns(random: Random) -> Columns:
    """A frequency response as header cells and numbers."""
    return [(cell, list(values)) for cell, values in SHEET.items()]


def _write_hdf5(path: Path, variables: dict[str, Any]) -> None:
    with h5py.File(path, "w") as file:
        for name, value in variables.items():
            item = np.array(value)
            name = name.replace("/", "_").strip(".") or "x"
            if name not in file:
                file.create_dataset(name, data=item.astype("S") if item.dtype.kind in "UO" else item)


def _numbers(values: list[Any]) -> np.ndarray:
    return np.array([value if isinstance(value, float | int) else np.nan for value in values], dtype=float)


def _spoil(row: list[str], random: Random) -> None:
    """A cell less, one more, or another one."""
    place = random.randint(0, len(row))
    row[place : place + random.randint(0, 1)] = random.choice(([], ["1"], [random.choice(CELLS)]))


def _header(columns: Columns, random: Random) -> Columns:
    place = random.randrange(len(columns)) if columns else 0
    if not columns:
        return columns
    cell, values = columns[place]
    name = cell.split(" [")[0]
    other = (f"{name} [{random.choice(UNITS)}]", name, f"{name} [", f"{name}]", f" {cell} ", cell.upper(), "", LONG)
    columns[place] = (random.choice((*other, random.choice(columns)[0], "velocity [m/s]", "t", '"x')), values)
    return columns


def _rearranged(columns: Columns, random: Random) -> Columns:
    place = random.randrange(len(columns) + 1)
    if random.random() < 0.5:
        return columns[:place] + columns[place + 1 :]
    random.shuffle(columns)
    return columns + columns[:place] if random.random() < 0.3 else columns


def _changed_values(columns: Columns, random: Random) -> Columns:
    """Numbers of one column scaled, turned round, held, replaced or left out."""
    if not columns:
        return columns
    place = random.randrange(len(columns))
    cell, values = columns[place]
    changed = list(values)
    for _ in range(random.choice((1, 1, 5, 30))):
        if changed:
            changed[random.randrange(len(changed))] = random.choice((*NUMBERS, "", "abc", float("nan")))
    half = len(values) // 2
    scaled = [value * 10.0 ** random.randint(-300, 300) if isinstance(value, float) else value for value in values]
    columns[place] = (
        cell,
        random.choice((changed, changed, values[::-1], values[:1] * len(values), scaled, values[:half])),
    )
    return columns


def _changed_rows(columns: Columns, random: Random) -> Columns:
    """Rows of all columns: fewer, twice, in another order."""
    length = min((len(values) for _, values in columns), default=0)
    rows = list(range(length))
    if random.random() < 0.3:
        rows = rows[: random.randint(0, 12)]
    elif rows:
        del rows[random.randrange(length)]
        rows.insert(random.randrange(length), random.randrange(length))
    return [(cell, [values[i] for i in rows]) for cell, values in columns]


_CHANGES: tuple[Callable[[Columns, Random], Columns], ...] = (
    _header,
    _header,
    _rearranged,
    _changed_values,
    _changed_rows,
)

_ARROW: tuple[Callable[[np.ndarray], pa.Array], ...] = (
    lambda v: pa.array(v.clip(-1e30, 1e30).astype(np.float32)),
    lambda v: pa.array([str(value) for value in v]),
    lambda v: pa.array([None] * len(v), pa.float64()),
    lambda v: pa.nulls(len(v)),
    lambda v: pa.array([bool(value > 0) for value in v]),
    lambda v: pa.array([[value] for value in v]),
    lambda v: pa.array([{"a": value} for value in v]),
    lambda v: pa.array([round(value * 1e9) if abs(value) < 1e9 else 0 for value in v], pa.timestamp("ns")),
    lambda v: pa.array([Decimal(f"{value:.3f}") if abs(value) < 1e9 else None for value in v], pa.decimal128(20, 3)),
    lambda v: pa.array([f"{value:.3g}" for value in v]).dictionary_encode(),
    lambda v: pa.array(v.clip(-1e4, 1e4).astype(np.float16)),
    lambda v: pa.array([int(value) if abs(value) < 1e9 else 2**62 for value in v], pa.int64()),
)

_MATLAB: tuple[Callable[[np.ndarray], Any], ...] = (
    lambda v: v.reshape(-1, 1),
    lambda v: np.ones((3, 3)),
    lambda v: v + 1j,
    lambda v: v.clip(-1e30, 1e30).astype(np.float32),
    lambda v: v > 0,
    lambda v: "text",
    lambda v: 1.0,
    lambda v: v[: len(v) // 2],
    lambda v: np.nan_to_num(v, posinf=0, neginf=0).clip(-100, 100).astype(np.int8),
    lambda v: np.zeros((0, 0)),
    lambda v: v.reshape(1, 1, -1),
)
