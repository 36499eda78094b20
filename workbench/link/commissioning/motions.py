"""The standard records of a commissioning, and the guard under which they are played."""

from dataclasses import replace

from ...control.controller_spec import ControllerSpec
from ...loop.drive_simulation import drive
from ...loop.standard_records import standard_set
from ...records.excitation import Excitation
from ...rigs.number import Number
from ...rigs.rig import Rig
from .allowed import Allowed, safe

_DOUBT = 1.2  # of the travel that the datasheet's flow says


def doubted(rig: Rig) -> Rig:
    """The rig with a guard that knows that the valve may have another flow than the datasheet says: none at all, but
    not the other way."""
    limit = Number("flow_error", _DOUBT, "1", "1", "commissioning: the valve is not known yet")
    return replace(rig, limits={**rig.limits, "flow_error": limit})


def standard_records(plants: Allowed, loop: ControllerSpec) -> list[Excitation]:
    """The standard records in a loop, as large as all plants that are allowed take them."""
    return safe(plants, loop, list(standard_set(replace(drive(plants.rig), loop=loop)).values()))
