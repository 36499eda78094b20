"""The kinds of load: what pushes back at the moving mass besides the specimen, with the numbers of each."""

from collections.abc import Mapping

from ..base.units import Spec

SPECIMEN, GRIPS, ROD_CELL, MEASURED = "specimen", "grips", "rod-cell", "measured"
LOADS: dict[str, Mapping[str, Spec]] = {
    SPECIMEN: {},
    GRIPS: {"Mg": Spec("kg", 0.0, 1e5, "part of the moving mass between the load cell and the specimen")},
    ROD_CELL: {"Mr": Spec("kg", 0.0, 1e5, "part of the moving mass between the piston and the load cell on its rod")},
    MEASURED: {},
    "cylinder": {"AL": Spec("m^2", 1e-5, 3.0, "area of a cylinder that pushes back with a set pressure")},
}
"""Further numbers of the table `load`, by its kind; a rig file without a kind has a specimen alone.

A load that nobody describes is "measured": its recorded force is an input, and no signal to compare."""
