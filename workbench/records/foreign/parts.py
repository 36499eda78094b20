"""Foreign files as strict tables: .parquet files of doubles, each of a size that records are read at."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...base.errors import InputError, short_path
from ...base.files import MOST_BYTES
from .source import Heading, Source

if TYPE_CHECKING:
    import pyarrow

MOST_COLUMNS = 2000


@dataclass(frozen=True)
class ConvertedTable:
    """A table that was written: all of a foreign file, or so many rows of it as a record may have."""

    file: str
    origin: str
    headings: tuple[Heading, ...]
    rows: int
    period: float | None
    notes: tuple[str, ...]


def write_parts(source: Source, origin: Path, folder: Path, name: str, most: int = MOST_BYTES) -> list[ConvertedTable]:
    """Write a source into `folder` as NAME.parquet, or as NAME-1.parquet ... where it takes more than `most` bytes.

    Raises InputError for a file without a column of numbers or without rows, with too many columns, and as its blocks.
    """
    columns = len(source.headings)
    if not 0 < columns <= MOST_COLUMNS:
        raise InputError(f"{short_path(origin)}: {columns} columns of numbers; keep 1 to {MOST_COLUMNS}")
    rows = [_write(pieces, folder / f"{name}-{number}.parquet", source.headings)
            for number, pieces in enumerate(_cut(source, max(1, most // (8 * columns))), 1)]  # fmt: skip
    if sum(rows) == 0:
        raise InputError(f"{short_path(origin)}: a header but no rows; record or export it again")
    files = [f"{name}-{number}.parquet" for number in range(1, len(rows) + 1)]
    if len(files) == 1:
        (folder / files[0]).rename(folder / f"{name}.parquet")
        files = [f"{name}.parquet"]
    else:
        source.notes.append(f"cut into {len(files)} records: a record has {most // 2**20} MiB at most")
    return [ConvertedTable(file, origin.name, source.headings, count, source.period, tuple(source.notes))
            for file, count in zip(files, rows, strict=True)]  # fmt: skip


def _cut(source: Source, most: int) -> Iterator[Iterator[Sequence[np.ndarray]]]:
    """The blocks in groups of at most `most` rows; each group is to be read before the next."""
    waiting: list[Sequence[np.ndarray]] = []

    def group() -> Iterator[Sequence[np.ndarray]]:
        room = most
        while room:
            block = waiting.pop() if waiting else next(source.blocks, None)
            if block is None:
                return
            size = len(block[0])
            if size > room:
                waiting.append([values[room:] for values in block])
                block, size = [values[:room] for values in block], room
            room -= size
            yield block

    yield group()
    while True:
        block = waiting.pop() if waiting else next((b for b in source.blocks if len(b[0])), None)
        if block is None:
            return
        waiting.append(block)
        yield group()


def _write(blocks: Iterator[Sequence[np.ndarray]], path: Path, headings: Sequence[Heading]) -> int:
    """Write blocks; how many rows they have."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([(heading.cell, pa.float64()) for heading in headings])
    rows = 0
    with pq.ParquetWriter(path, schema) as writer:
        for block in blocks:
            rows += len(block[0])
            writer.write_table(pa.table([pa.array(values) for values in block], schema=schema))
    return rows


def renamed(path: Path, cells: Mapping[str, str]) -> None:
    """Rename columns of a part, block by block."""
    import pyarrow.parquet as pq

    table = pq.ParquetFile(path)
    if not set(cells) & set(table.schema_arrow.names):
        return
    names = [cells.get(name, name) for name in table.schema_arrow.names]
    beside = path.with_suffix(".renamed")
    schema = _with_names(table.schema_arrow, names)
    with pq.ParquetWriter(beside, schema) as writer:
        for batch in table.iter_batches():
            writer.write_batch(batch.rename_columns(names))
    table.close()
    beside.replace(path)


def _with_names(schema: "pyarrow.Schema", names: Sequence[str]) -> "pyarrow.Schema":
    import pyarrow as pa

    return pa.schema([(name, field.type) for name, field in zip(names, schema, strict=True)])


def column(path: Path, cell: str) -> np.ndarray:
    """A column [n] of a part, NaN where a cell is missing."""
    import pyarrow.parquet as pq

    return np.array(pq.read_table(path, columns=[cell]).column(0).to_numpy(), dtype=float)
