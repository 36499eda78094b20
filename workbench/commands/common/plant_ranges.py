"""What plants were drawn over, for a report."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...report import Table
from ...report.table import Cell


def ranges_table(columns: Mapping[str, np.ndarray], *further: Sequence[Cell]) -> Table:
    """The least and the largest of a draw's `columns`, the position last; with `further` rows."""
    position, *numbers = (
        [*name.removesuffix("]").rsplit(" [", 1), float(values.min()), float(values.max())]
        for name, values in columns.items()
    )
    rows = [[name, least, largest, unit] for name, unit, least, largest in (*numbers, position)]
    return Table("Uniform within these ranges", ["number", "least", "largest", "unit"], [*rows, *further])
