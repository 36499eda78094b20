"""The kinds of jack: which numbers they have, and which of these are the areas and dead volumes of the two sides."""

from collections.abc import Mapping
from dataclasses import dataclass

from ..base.units import Spec

_COMMON = {
    "S": Spec("m", 1e-3, 20.0, "stroke between the end stops"),
    "xmid": Spec("m", -20.0, 20.0, "position signal at mid stroke"),
    "Cl": Spec("m^3/s/Pa", 0.0, 1e-9, "laminar leakage between the chambers"),
    "ke": Spec("N/m", 1e3, 1e11, "stiffness of an end stop"),
    "ce": Spec("N s/m", 0.0, 1e8, "damping of an end stop"),
}


@dataclass(frozen=True)
class JackKind:
    """A kind of jack; `areas` and `dead_volumes` name the numbers of side A and side B."""

    name: str
    numbers: Mapping[str, Spec]
    areas: tuple[str, str]
    dead_volumes: tuple[str, str]


DOUBLE_ROD = JackKind(
    "double-rod",
    {
        "Aj": Spec("m^2", 1e-5, 3.0, "piston area, both sides"),
        "V0": Spec("m^3", 1e-8, 0.5, "dead volume of a side"),
        **_COMMON,
    },
    areas=("Aj", "Aj"),
    dead_volumes=("V0", "V0"),
)
DIFFERENTIAL = JackKind(
    "differential",
    {
        "AA": Spec("m^2", 1e-5, 3.0, "piston area of chamber A"),
        "AB": Spec("m^2", 1e-5, 3.0, "annulus area of chamber B"),
        "V0A": Spec("m^3", 1e-8, 0.5, "dead volume of side A"),
        "V0B": Spec("m^3", 1e-8, 0.5, "dead volume of side B"),
        **_COMMON,
    },
    areas=("AA", "AB"),
    dead_volumes=("V0A", "V0B"),
)
JACKS: dict[str, JackKind] = {kind.name: kind for kind in (DOUBLE_ROD, DIFFERENTIAL)}
