"""A valve in the lines between servo-valve and jack that lets oil in freely and out only when it is opened.

[line_valve]
kind = "counterbalance"          # or "check": a pilot-operated check valve
side = "A"                       # or "B", or "both" with two of the same valve
line_setting = {value = 200, unit = "bar", source = "datasheet", bounds = [180, 220]}
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..base.units import Spec
from .schema import ORIFICE

if TYPE_CHECKING:
    from ..base.table import ConfigTable

CHECK, COUNTERBALANCE = "check", "counterbalance"
_FREE = {
    "line_volume": Spec("m^3", 1e-7, 1.0, "volume of the line between the servo-valve and the line valve"),
    "line_cracking": Spec("Pa", 1e3, 5e6, "pressure difference into the chamber that cracks the check"),
    "line_lift": Spec("Pa", 1e3, 1e7, "what the check is pressed beyond cracking until it is fully open"),
    "line_flow": Spec(ORIFICE, 1e-9, 1e-3, "flow of the fully open check per root of its pressure drop"),
    "line_ratio": Spec("1", 0.1, 30.0, "pilot ratio: pilot area over that which the chamber's pressure acts on"),
}
LINE_VALVES: dict[str, Mapping[str, Spec]] = {
    CHECK: _FREE,
    COUNTERBALANCE: {
        **_FREE,
        "line_setting": Spec("Pa", 1e5, 1e8, "pressure of the chamber that opens the valve without a pilot pressure"),
        "line_span": Spec("Pa", 1e4, 1e8, "pressure beyond the setting at which the valve is fully open"),
        "line_return": Spec(ORIFICE, 1e-9, 1e-3, "flow out of the fully open valve per root of its pressure drop"),
        "line_back_ratio": Spec(
            "1", 0.0, 31.0, "how the line's pressure adds to the setting: 1 + pilot ratio, 0 of a vented spring"
        ),
    },
}
"""The numbers of each kind; all of a table must be there."""
SPRINGS = ("line_lift", "line_span")
"""Of these, the pressures over which springs let a valve open."""
SIDES = {"A": (True, False), "B": (False, True), "both": (True, True)}


@dataclass(frozen=True)
class LineValve:
    """Its `kind`, of LINE_VALVES, and the `side` it is on, of SIDES. Its numbers are among those of the rig."""

    kind: str
    side: str

    @property
    def specs(self) -> Mapping[str, Spec]:
        """Unit, possible range and meaning of its numbers."""
        return LINE_VALVES[self.kind]

    @property
    def on(self) -> tuple[bool, bool]:
        """Whether it is in the line of A, of B."""
        return SIDES[self.side]

    @property
    def title(self) -> str:
        """In a few words, after those for valve and jack."""
        where = "lines" if self.side == "both" else f"line {self.side}"
        return f"{self.kind} valve in {where}"

    def table(self) -> dict[str, str]:
        """The table of a rig file, without its numbers."""
        return {"kind": self.kind, "side": self.side}


def read_line_valve(table: "ConfigTable") -> LineValve:
    """That of the table `line_valve` of a rig file, without its numbers. Raises InputError with file and row."""
    return LineValve(table.word("kind", LINE_VALVES), table.word("side", SIDES))
