"""Recordings as laboratories leave them, made of the sample campaign: other names, units, signs, separators."""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from workbench.base.signals import SIGNALS
from workbench.base.units import from_si
from workbench.records import Record, load_campaign
from workbench.records.foreign import column, open_foreign, write_parts

SAMPLE = Path(__file__).parents[1] / "experiments" / "sample"


@cache
def sample() -> dict[str, Record]:
    """The records of the sample by name: static, steps, triangle, multisine; of a jack of 10 t."""
    return {record.name.partition(".")[0]: record for record in load_campaign(SAMPLE).records}


def columns(name: str, units: Mapping[str, str], rows: int | None = None) -> dict[str, np.ndarray]:
    """Signals [rows] of a record of the sample in other units, t among them."""
    record = sample()[name]
    values = {"t": record.t, **record.signals}
    return {key: from_si(values[key][:rows], unit, SIGNALS[key].si) for key, unit in units.items()}


def text(header: Sequence[str], table: Sequence[np.ndarray], separator: str = ",", decimal: str = ".") -> str:
    """Lines above a table, and the table."""
    rows = zip(*(values.tolist() for values in table), strict=True)
    lines = [separator.join(f"{value:.9g}" for value in row).replace(".", decimal) for row in rows]
    return "\n".join([*header, *lines, ""])


def clock(path: Path) -> np.ndarray:
    """The times [n] s of a foreign file, of the column that is its clock."""
    source = open_foreign(path)
    (part,) = write_parts(source, path, path.parent, "made")
    (cell,) = [heading.cell for heading in part.headings if heading.unit == "s"]
    return column(path.parent / part.file, cell)
