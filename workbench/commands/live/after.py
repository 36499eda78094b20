"""What takes longer than a slider's next move: the closed loop by sines of a stated amplitude, and hunting."""

from dataclasses import dataclass, replace

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...engine import Engine
from ...linear import Equilibrium
from ...linear.frequency_response import SteppedSine
from ...loop.describing_function import closed_loop_sine, sampled_frequencies
from ...loop.envelope import HUNTING
from ...loop.plant_lanes import PlantLanes
from ...loop.step_metrics import hunting_lanes
from ..common.experiment import BodeConfig
from .view import LiveTask, band_of, machine_code, step_part


@dataclass(frozen=True)
class AfterPart:
    """The closed loop of the nominal rig by sines of an amplitude, None of an unstable loop; which rigs hunt, bool
    [lanes], None where that is not looked at."""

    sines: SteppedSine | None
    hunting: np.ndarray | None


def after_part(
    lanes: PlantLanes, spec: ControllerSpec, task: LiveTask, sweep: BodeConfig, amplitude: float, stable: np.ndarray
) -> AfterPart:
    """Sines and hunting; neither of a linear loop that is not `stable` [lanes], nor hunting of a law in Python."""
    sines = _sines(lanes, spec, sweep, amplitude) if stable[0] else None
    controller = spec.build(lanes.rig.period.value)
    if task.scenario.arrives is None or machine_code(lanes, controller, task) is None:
        return AfterPart(sines, None)
    calm, size = step_part(lanes, controller, replace(task, seed=None)), task.scenario.size
    share = HUNTING if size else 1.0
    band = size or band_of(lanes, task)
    return AfterPart(sines, hunting_lanes(lanes.rig.period.value, calm.y, band, share) & stable)


def _sines(lanes: PlantLanes, spec: ControllerSpec, sweep: BodeConfig, amplitude: float) -> SteppedSine:
    rig, period = lanes.rig, lanes.rig.period.value
    engine = Engine(replace(lanes.engine.plant, p=lanes.p[0]))
    start = Equilibrium(lanes.null.x[0], lanes.null.u[0], 0.0)
    f = sampled_frequencies(sweep.low, sweep.high, sweep.points, period)
    return closed_loop_sine(engine, rig, lambda: spec.build(period), start, f, amplitude)
