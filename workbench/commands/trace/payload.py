"""What a platform's campaign says of its payload: numbers that are others than the platform's file has."""

from collections.abc import Sequence
from typing import Any

from ...identify.wrench.balance import NUMBERS
from ...identify.wrench.fitted import PayloadFit
from ...report import Table, within
from ...rigs.platform import Platform
from ...rigs.platform.platform import PAYLOAD

SURE = 2.5  # half widths of the 95 % interval
MATTERS = 0.02  # of the mass, of the radius of the joints, of the mean moment of inertia
TOLD = 0.1  # of these: half widths of intervals of numbers that records do not tell are wider


def payload_numbers(platform: Platform, payload: PayloadFit) -> list[dict[str, Any]]:
    """The numbers of the payload that the records contradict, and that matter, by the keys of trace.json, SI."""
    return [row for row, differs in _rows(platform, payload) if differs]


def payload_sentence(wrong: Sequence[dict[str, Any]]) -> str:
    """What is another number; nothing where none is."""
    said = [
        f"{row['name'].split('.')[1]} is {row['found']:.4g} where {row['described']:.4g} is described" for row in wrong
    ]
    return f" The payload is another one: {', '.join(said)}." if said else ""


def payload_table(platform: Platform, payload: PayloadFit) -> Table:
    """Every number of the payload as described and as found."""
    rows = [
        [row["name"], row["described"], *within(row["found"], row["low"], row["high"]), differs]
        for row, differs in _rows(platform, payload)
    ]
    note = (
        "By least squares of the forces of the legs, of load cells or else of pressures, on the measured motion. "
        f"Another: beyond {SURE:g} half widths of the interval, and by {MATTERS:.0%} or more of the mass, of the "
        "radius of the joints or of the mean moment of inertia, where the interval is no wider than a "
        "tenth of these to either side."
    )
    return Table("Payload", ["number", "described", "found", "95 % low", "95 % high", "another"], rows, note=note)


def _rows(platform: Platform, payload: PayloadFit) -> list[tuple[dict[str, Any], bool]]:
    inertia = sum(platform[f"I{axis}{axis}"] for axis in "xyz") / 3
    sizes = {"m": platform["mass"], "c": platform.geometry.radius, "I": inertia}
    rows = []
    for name, value, half in zip(NUMBERS, payload.values.tolist(), payload.halves.tolist(), strict=True):
        number = platform.numbers[name]
        off = abs(value - number.value)
        row = {"name": f"payload.{name} [{number.si}]", "described": number.value, "found": value}
        row |= {"low": value - half, "high": value + half}
        size = sizes[name[0]]
        told = half < TOLD * size and not PAYLOAD[name].problem(value)  # too little motion makes it nothing, or less
        rows.append((row, told and off > SURE * half and off > MATTERS * size))
    return rows
