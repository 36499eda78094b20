"""Parquet files of another maker: columns of numbers and of times, batch by batch."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...base.files import MOST_READ, check_numbers
from .source import Source, unique_headings
from .unit_names import heading_of


def read_parquet(path: Path) -> Source:
    """The columns of numbers. Raises what pyarrow does for a broken file."""
    import pyarrow.parquet as pq

    file = pq.ParquetFile(path)
    check_numbers(path, file.metadata.num_rows * file.metadata.num_columns, 16 * MOST_READ)
    kinds = {field.name: field.type for field in file.schema_arrow}
    names = [name for name, kind in kinds.items() if _is_numeric(kind)]
    left = [name for name in kinds if name not in names]
    notes = [f"left out, no numbers: {', '.join(left)}"] if left else []

    def blocks() -> Iterator[list[np.ndarray]]:
        for batch in file.iter_batches(columns=names):
            yield [np.array(batch.column(name).cast("float64"), dtype=float) for name in names]

    return Source(unique_headings([heading_of(name) for name in names]), blocks(), None, notes)


def _is_numeric(kind: object) -> bool:
    import pyarrow as pa

    return pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
