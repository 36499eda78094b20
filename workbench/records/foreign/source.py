"""What every foreign format is read into: headed columns of numbers, block by block."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

UNREAD = "left out, no numbers"
"""Begins the note on columns that are neither numbers nor stamps; a cell of each follows."""


@dataclass(frozen=True)
class Heading:
    """A column: its header cell as the file has it, and the unit of its numbers where the file says one.

    between: how it was filled between samples that are further apart than the rows, "held" or "linear"
    """

    cell: str
    unit: str | None = None
    between: str | None = None


@dataclass(frozen=True)
class Source:
    """A foreign file: `blocks` are rows in their order, each block a list of one array [rows] a heading, NaN missing.

    period  s from row to row, where the file says so and has no clock
    notes   what was done to read it, one sentence each; complete when the blocks have been read
    """

    headings: tuple[Heading, ...]
    blocks: Iterator[Sequence[np.ndarray]]
    period: float | None = None
    notes: list[str] = field(default_factory=list)


def unique_headings(headings: Sequence[Heading]) -> tuple[Heading, ...]:
    """The headings with cells that differ: an empty cell gets its number, a repeated one is numbered."""
    cells: dict[str, Heading] = {}
    for number, heading in enumerate(headings, 1):
        plain = " ".join(heading.cell.split()) or f"column {number}"
        cell, again = plain, 1
        while cell in cells:
            again += 1
            cell = f"{plain} #{again}"
        cells[cell] = replace(heading, cell=cell)
    return tuple(cells.values())
