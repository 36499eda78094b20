"""The limits of a live rig as its pages tell them: what each is, whose it is, and where something tripped."""

from collections.abc import Sequence
from typing import Any

from ...report import Mark, Section, Table
from ...rigs.limited import whose
from ...rigs.number import Number
from ...rigs.rig import Rig

_NOTE = "Of the rig file and the live rig's hello the tighter one is kept, by all that is foreseen and by the guard, "
_NOTE += "unless its line says otherwise."
_HIDDEN = "flow_error"  # of the guard's observer: no limit of the rig


def limits_json(rig: Rig) -> list[dict[str, Any]]:
    """The limits as metrics.json has them, SI."""
    return [{"limit": each.name, "value": each.value, "unit": each.si, "whose": whose(each)} for each in _all(rig)]


def limits_section(rig: Rig, more: Sequence[str] = ()) -> Section:
    """A table of them, and sentences on what they changed."""
    rows = [[each.name.replace("_", " "), each.shown, each.unit, whose(each)] for each in _all(rig)]
    return Section("Limits", [Table("", ["limit", "value", "unit", "whose"], rows, _NOTE), *more])


def trip_marks(t: float | None) -> list[Mark]:
    """Marks of the time [s] at which something tripped, in a figure over time."""
    return [] if t is None else [Mark(t, "trip", "x")]


def _all(rig: Rig) -> list[Number]:
    own = (each for name, each in rig.limits.items() if name != _HIDDEN)
    return [*own, *(number for limit in rig.further_limits for number in limit.numbers), rig.period]
