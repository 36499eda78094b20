"""The record: a frozen table of what was logged, in SI, with what must not be compared marked as such."""

import gzip
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..base.signals import DRIVING, FURTHER_INPUTS, SIGNALS
from ..base.units import from_si


@dataclass(frozen=True, eq=False)
class Record:
    """Signals sampled together; row k is y = h(x(t_k), u_k), the command u_k being held until t_(k+1).

    t        [n] s, strictly increasing; a dropped sample leaves a longer interval, nothing is resampled
    signals  name -> [n] in the SI unit of `workbench.base.signals.SIGNALS`, finite everywhere
    valid    name -> [n] bool; False where a sample is filled or clipped and not to be compared; left out: all True
    notes    what was mended on reading, one sentence each
    late     s, by which every command acts after the row that logs it, which was sampled before; 0: as it is sampled
    """

    name: str
    t: np.ndarray
    signals: Mapping[str, np.ndarray]
    valid: Mapping[str, np.ndarray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    late: float = 0.0

    def __post_init__(self) -> None:
        t = _frozen(self.t, float)
        signals = {name: _frozen(values, float) for name, values in self.signals.items()}
        valid = {name: _frozen(self.valid.get(name, np.ones(t.size)), bool) for name in signals}
        if t.ndim != 1 or not np.all(np.isfinite(t)) or not np.all(np.diff(t) > 0.0):
            raise ValueError(f"record {self.name}: t must be one column, finite and strictly increasing")
        for name, values in signals.items():
            if values.shape != t.shape or valid[name].shape != t.shape:
                raise ValueError(f"record {self.name}: {name} must have {t.size} samples, as t has")
            if not np.all(np.isfinite(values)):
                raise ValueError(f"record {self.name}: {name} must be finite; mark what is missing in `valid`")
        for name, value in (("t", t), ("signals", signals), ("valid", valid), ("notes", tuple(self.notes))):
            object.__setattr__(self, name, value)

    @property
    def names(self) -> tuple[str, ...]:
        """The signals it carries."""
        return tuple(self.signals)

    @property
    def period(self) -> float:
        """Sampling period, s: the median interval, which dropped samples and jitter do not move."""
        return float(np.median(np.diff(self.t)))

    def slice(self, start: float | None = None, stop: float | None = None) -> "Record":
        """The rows with start <= t < stop (s); None leaves an end open. Time stamps stay as recorded."""
        slack = 1e-3 * self.period  # 0.3 s must find the row that was logged as 0.29999999
        first = 0 if start is None else int(np.searchsorted(self.t, start - slack))
        last = self.t.size if stop is None else int(np.searchsorted(self.t, stop - slack))
        rows = slice(first, max(first, last))
        return Record(
            self.name,
            self.t[rows],
            {name: values[rows] for name, values in self.signals.items()},
            {name: mask[rows] for name, mask in self.valid.items()},
            self.notes,
            self.late,
        )

    def earlier(self, late: Mapping[str, float]) -> "Record":
        """The record with its signals earlier by what they are `late` [s]; what then lacks a sample is not compared."""
        signals, valid = dict(self.signals), dict(self.valid)
        for name in late.keys() & signals.keys():
            t = self.t + late[name]
            signals[name] = np.interp(t, self.t, self.signals[name])
            known = np.interp(t, self.t, self.valid[name].astype(float)) == 1.0
            valid[name] = known & (t >= self.t[0]) & (t <= self.t[-1])
        return replace(self, signals=signals, valid=valid)


def block_mean(record: Record, rows: int) -> Record:
    """Means over blocks of `rows` rows (an incomplete last block is left out), for records far faster than the rig.

    Time, command and reference are those at the block's first row. A mean stands for the middle of its block, so
    answers seem to lead the command by (rows - 1)/2 original periods: keep blocks short beside the rig's delays.
    """
    blocks = record.t.size // rows
    if rows < 1 or blocks < 1:
        raise ValueError(f"record {record.name}: blocks of {rows} rows do not fit {record.t.size} rows")
    blocked = {name: values[: blocks * rows].reshape(blocks, rows) for name, values in record.signals.items()}
    return Record(
        record.name,
        record.t[: blocks * rows : rows],
        {name: values[:, 0] if name in DRIVING else values.mean(axis=1) for name, values in blocked.items()},
        {name: np.all(mask[: blocks * rows].reshape(blocks, rows), axis=1) for name, mask in record.valid.items()},
        (*record.notes, f"means over blocks of {rows} rows"),
        record.late,
    )


def centred_means(record: Record, rows: int) -> Record:
    """Every `rows`-th row: inputs are means over the rows up to the next one, for which they are held; what answers
    is the mean over as many rows about the kept one, so that nothing leads or lags. An incomplete end is left out.
    """
    inputs, count = (*DRIVING, *FURTHER_INPUTS), record.t.size // rows
    if rows < 1 or count < 1:
        raise ValueError(f"record {record.name}: means of {rows} rows do not fit {record.t.size} rows")

    def blocks(values: np.ndarray, early: int) -> np.ndarray:
        padded = np.concatenate((np.repeat(values[:1], early), values))
        return padded[: count * rows].reshape(count, rows)

    early = {name: 0 if name in inputs else rows // 2 for name in record.names}
    return Record(
        record.name,
        record.t[: count * rows : rows],
        {name: blocks(values, early[name]).mean(axis=1) for name, values in record.signals.items()},
        {name: np.all(blocks(mask, early[name]), axis=1) for name, mask in record.valid.items()},
        (*record.notes, f"means over {rows} rows"),
        record.late,
    )


def _frozen(values: np.ndarray, kind: type) -> np.ndarray:
    out = np.array(values, dtype=kind)
    out.setflags(write=False)
    return out


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
