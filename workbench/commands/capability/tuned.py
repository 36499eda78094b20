"""The loops that a sheet plays: one that tunes itself on the rig's model, and what the engine is asked by."""

from dataclasses import replace

import numpy as np

from ...base.errors import InputError
from ...control.automatic_tuning import pulses
from ...control.controller_spec import ControllerSpec
from ...loop.automatic import self_tuning
from ...loop.rows import LoopSetup
from ...loop.sampled_loop import SampledLoop
from ...rigs.rig import Rig
from ...rigs.sensor import Sensor


def seeing(rig: Rig) -> Rig:
    """The rig with a position that is known, as it is to the engine, where no sensor says it."""
    if "position" in rig.sensors:
        return rig
    return replace(rig, sensors={**rig.sensors, "position": Sensor(0.0, 0.0)})


def self_tuned(setup: LoopSetup) -> ControllerSpec | str:
    """What the moves of `controllers.automatic` make of a rig, without noise; else why there is nothing."""
    spec = self_tuning(setup.rig)
    controller = spec.build(setup.rig.period.value)
    try:
        loop = SampledLoop(setup.engine, setup.rig, controller, setup.null)
    except InputError as error:
        return str(error)
    run = loop.run(np.full(pulses(spec.design.pulse, setup.rig.period.value).size, setup.rig.middle))
    law = getattr(controller, "law", None)
    if run.tripped:
        return f"the moves by which it would tune itself trip: {run.tripped}"
    if law is None:
        return "the moves by which it would tune itself do not come to their end"
    return replace(law, name="automatic")
