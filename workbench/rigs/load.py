"""The kinds of load: what pushes back at the moving mass besides the specimen, with the numbers of each."""

from collections.abc import Mapping

from ..base.units import Spec

SPECIMEN = "specimen"
LOADS: dict[str, Mapping[str, Spec]] = {
    SPECIMEN: {},
    "cylinder": {"AL": Spec("m^2", 1e-6, 10.0, "area of a cylinder that pushes back with a set pressure")},
}
"""Further numbers of the table `load`, by its kind; a rig file without a kind has a specimen alone."""
