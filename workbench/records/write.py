"""Records to files, in the units that people are shown; what is not valid becomes an empty cell."""

import gzip
from pathlib import Path

import numpy as np

from ..base.signals import SIGNALS
from ..base.units import from_si
from .record import Record


def write_csv(record: Record, path: str | Path) -> None:
    """Write a .csv or .csv.gz with header cells `name [unit]`, 10 digits; the same record gives the same bytes."""
    path = Path(path)
    table = _shown(record)
    columns = [["" if np.isnan(value) else f"{value:.10g}" for value in values.tolist()] for values in table.values()]
    lines = [",".join(table), *(",".join(cells) for cells in zip(*columns, strict=True)), ""]
    content = "\n".join(lines).encode()
    path.write_bytes(gzip.compress(content, mtime=0) if path.name.lower().endswith(".gz") else content)


def write_parquet(record: Record, path: str | Path) -> None:
    """Write a .parquet with columns `name [unit]` of doubles."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(_shown(record)), path)


def _shown(record: Record) -> dict[str, np.ndarray]:
    table = {SIGNALS["t"].label: record.t}
    for name, values in record.signals.items():
        signal = SIGNALS[name]
        shown = from_si(values, signal.unit, signal.si)
        # a held command stays: it is the input, and a model needs it everywhere
        table[signal.label] = shown if name == "command" else np.where(record.valid[name], shown, np.nan)
    return table
