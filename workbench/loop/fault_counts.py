"""What faults came to, counted: which did harm, and which no command could have stopped."""

from collections.abc import Mapping, Sequence
from typing import Any

STOP, BEYOND = 0.2, 10.0  # m/s at the end stop, and percent beyond a limit, up to which a fault did no harm
_HELPLESS = ("valve stuck",)  # faults against which no command helps


def harmful(row: Mapping[str, Any]) -> bool:
    """Whether it met the stop too fast, or passed a limit by too much."""
    return row["stop_speed"] > STOP or row["beyond_percent"] > BEYOND


def helpless(row: Mapping[str, Any]) -> bool:
    """Whether it did harm that no command could have prevented."""
    return harmful(row) and row["fault"].startswith(_HELPLESS)


def counts(rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """How many faults were `played` and `detected`, how many did `harm` that a command could have prevented, and how
    many others, `helpless`."""
    harm = [row for row in rows if harmful(row)]
    lost = sum(map(helpless, rows))
    detected = sum(row["detected_ms"] is not None for row in rows)
    return {"played": len(rows), "detected": detected, "harm": len(harm) - lost, "helpless": lost}
