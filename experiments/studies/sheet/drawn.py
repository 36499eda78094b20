"""Rigs within the bounds of one, and lines of their sheets beside the truth."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from workbench.identify.acceptance.row import Row
from workbench.rigs.rig import Rig


@dataclass(frozen=True)
class Held:
    """A line of one rig's sheet: its interval, and the truth, in the line's unit."""

    id: str
    low: float
    high: float
    value: float
    truth: float

    @property
    def holds(self) -> bool:
        """Whether the interval holds the truth, but for rounding."""
        room = 1e-9 * max(abs(self.low), abs(self.high), abs(self.truth))
        return self.low - room <= self.truth <= self.high + room


def within_bounds(rig: Rig, random: np.random.Generator) -> Rig:
    """The rig with every number that has bounds drawn evenly between them."""
    bounded = {n.name: (n.low, n.high) for n in rig.numbers.values() if n.low is not None and n.high is not None}
    return rig.with_values(**{name: float(random.uniform(*ends)) for name, ends in bounded.items()})


def beside_truth(rows: Iterable[Row], truths: Mapping[str, float | None]) -> list[Held]:
    """The lines that are said and whose truth is known."""
    return [
        Held(row.id, row.low, row.high, row.value, truth)
        for row in rows
        if row.value is not None and row.low is not None and row.high is not None
        and (truth := truths.get(row.id)) is not None
    ]  # fmt: skip
