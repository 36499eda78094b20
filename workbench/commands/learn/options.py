"""`jackbench learn EXPERIMENT`: a record that is repeated, how often, and by what the filter is measured."""

import argparse
from functools import partial

from ...base.units import Spec
from ...control.controller_spec import ControllerSpec
from ...control.platform_controller import PlatformSpec
from ...loop.platform.learning import PayloadDraw
from ...records.excitation import MultisineSpec
from ..common.declared import MANY, ExperimentFile, count, declared, part, takes_experiment
from ..common.envelope_keys import draws_nothing, read_ends
from ..common.experiment import load_either, sole_controller
from ..common.platform_experiment import PlatformExperiment
from ..common.platform_motion import MOTION, PlatformMotion, read_motion
from ..common.record_experiment import MEASURE, RecordExperiment, read_multisine

_MOST_PLANTS = 1000
_AT_JOINTS = Spec("m", 1e-6, 1.0, "largest deviation at the joints")


def _measure(at: ExperimentFile) -> MultisineSpec | None:
    amplitude = Spec(at.signal.si, 1e-9, 1e9, "peak of the multisine")
    there = "measure" in at.top
    return read_multisine(at.top.table("measure"), amplitude, at.rig.nyquist) if there else None


@declared
class LearnConfig(RecordExperiment):
    """A record that a controller repeats at most so often; the filter is that of the first rig.

    With `measure` the filter is made of a measured response, else of the linear loop.
    """

    KIND = "learn"
    controller: ControllerSpec = part(sole_controller, {})
    iterations: int = count(1, MANY, "repetitions, at most")
    measure: MultisineSpec | None = part(_measure, MEASURE)


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
        lambda at: read_multisine(at.top.table("measure"), _AT_JOINTS, 0.5 / at.rig.period, 1.0), MEASURE
    )
    iterations: int = count(1, MANY, "repetitions, at most")


load_any = partial(load_either, LearnConfig, PlatformLearnConfig)  # of one jack or of a platform


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    what = "a learn experiment, such as experiments/learn_sine.toml"
    takes_experiment(parser, what, LearnConfig, "learn.platform:run_any", load_any)
