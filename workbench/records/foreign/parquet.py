"""Parquet files of another maker: columns of numbers and of times, batch by batch."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...base.errors import echo
from ...base.files import MOST_READ, check_numbers
from .source import UNREAD, Source, unique_headings
from .stamps import is_stamp
from .unit_names import heading_of

if TYPE_CHECKING:
    import pyarrow
    from pyarrow.parquet import ParquetFile


def read_parquet(path: Path) -> Source:
    """The columns of numbers. Raises what pyarrow does for a broken file."""
    import pyarrow.parquet as pq

    file = pq.ParquetFile(path)
    check_numbers(path, file.metadata.num_rows * file.metadata.num_columns, 16 * MOST_READ)
    kinds = {field.name: field.type for field in file.schema_arrow}
    cells = {name: _first_text(file, name) for name, kind in kinds.items() if _is_text(kind)}
    stamped = {name for name, cell in cells.items() if is_stamp(cell)}
    names = [name for name, kind in kinds.items() if _is_numeric(kind) or _is_time(kind) or name in stamped]
    left = [f"{name} ({echo(cells.get(name) or str(kind))})" for name, kind in kinds.items() if name not in names]
    notes = [f"{UNREAD}: {', '.join(left)}"] if left else []

    def blocks() -> Iterator[list[np.ndarray]]:
        for batch in file.iter_batches(columns=names):
            yield [_values(batch.column(name)) for name in names]

    return Source(unique_headings([heading_of(name) for name in names]), blocks(), None, notes)


def _is_numeric(kind: "pyarrow.DataType") -> bool:
    import pyarrow as pa

    return pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)


def _is_time(kind: "pyarrow.DataType") -> bool:
    import pyarrow as pa

    return pa.types.is_temporal(kind) and not pa.types.is_interval(kind)


def _is_text(kind: "pyarrow.DataType") -> bool:
    import pyarrow as pa

    plain = kind.value_type if pa.types.is_dictionary(kind) else kind
    return pa.types.is_string(plain) or pa.types.is_large_string(plain)


def _first_text(file: "ParquetFile", name: str) -> str:
    """The first cell of a column of text."""
    batch = next(file.iter_batches(batch_size=1000, columns=[name]), None)
    return next((str(cell) for cell in batch.column(0).to_pylist() if cell), "") if batch is not None else ""


def _values(column: "pyarrow.Array") -> np.ndarray:
    """Numbers, stamps and text as `origin` takes them: whole numbers and times keep all their digits."""
    import pyarrow as pa

    kind = column.type
    if _is_text(kind):
        return np.array(column.to_pylist(), dtype=object)
    if pa.types.is_time(kind):
        whole = column.view(pa.int32() if kind.bit_width == 32 else pa.int64())
        column = whole.cast(pa.int64()).cast(f"duration[{kind.unit}]")
    if _is_time(kind):
        return column.to_numpy(zero_copy_only=False)
    if pa.types.is_integer(kind) and not column.null_count:
        return column.to_numpy(zero_copy_only=False)
    return np.array(column.cast("float64"), dtype=float)
