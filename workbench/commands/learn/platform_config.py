"""A learning experiment on a platform: a motion, what measures the loop, payloads that are drawn."""

from ...base.units import Spec
from ...control.platform_controller import PlatformSpec
from ...loop.platform.learning import PayloadDraw
from ...records.excitation import MultisineSpec
from ..common.declared import MANY, ExperimentFile, count, declared, part
from ..common.envelope_keys import draws_nothing, read_ends
from ..common.experiment import sole_controller
from ..common.platform_experiment import PlatformExperiment
from ..common.platform_motion import MOTION, PlatformMotion, read_motion
from ..common.record_experiment import MEASURE, read_multisine

_MOST_PLANTS = 1000
_AMPLITUDE = Spec("m", 1e-6, 1.0, "largest deviation at the joints")


def _drawn(at: ExperimentFile) -> PayloadDraw | None:
    if draws_nothing(at, "within"):
        return None
    table = at.top.table("within", "mass", "inertia", "centre")
    centre = Spec("m", 0.0, 10.0, "how far the centre of mass may be along each axis")
    mass, inertia = (read_ends(table, key) for key in ("mass", "inertia"))
    return PayloadDraw(at.plants, mass, inertia, table.quantity("centre", centre))


@declared
class PlatformLearnConfig(PlatformExperiment):
    """A motion that a controller repeats at most so often; the filter is that of the declared payload, measured.

    `drawn`: payloads that play it besides, or None.
    """

    KIND = "learn"
    controller: PlatformSpec = part(sole_controller, {})
    plants: int | None = count(1, _MOST_PLANTS, "platforms to draw besides; none without", default=None, asked=True)
    drawn: PayloadDraw | None = part(_drawn, {"within": "factors of the payload, and how far its centre may be"})
    motion: PlatformMotion = part(
        lambda at: read_motion(at.top.table("record", *MOTION), at.rig), {"record": "the motion that is repeated"}
    )
    sines: MultisineSpec = part(
        lambda at: read_multisine(at.top.table("measure"), _AMPLITUDE, 0.5 / at.rig.period, 1.0), MEASURE
    )
    iterations: int = count(1, MANY, "repetitions, at most")
