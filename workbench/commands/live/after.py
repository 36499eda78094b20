"""What takes longer than a slider's next move: the closed loop by sines of a stated amplitude, and hunting."""

from dataclasses import dataclass, replace

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...engine import Engine
from ...linear import Equilibrium
from ...loop.describing_function import closed_loop_sine, sampled_frequencies
from ...loop.envelope import HUNTING
from ...loop.lane_metrics import hunting_lanes
from ...loop.plant_lanes import PlantLanes
from ..common.experiment import BodeConfig
from .view import Task, step_part


@dataclass(frozen=True)
class AfterPart:
    """Reference -> controlled signal of the nominal rig, complex [k] at f [k] in Hz, by sines of an `amplitude` (SI),
    NaN where it trips; where a limit acts [k]; which rigs hunt, bool [lanes], None where that is not looked at."""

    amplitude: float
    f: np.ndarray
    response: np.ndarray
    limited: np.ndarray
    hunting: np.ndarray | None


def after_part(
    lanes: PlantLanes, spec: ControllerSpec, task: Task, sweep: BodeConfig, amplitude: float, quick: bool
) -> AfterPart:
    """Of a controller that computes in Python, which is not `quick`, hunting is left out."""
    rig, period = lanes.rig, lanes.rig.period.value
    engine = Engine(replace(lanes.engine.plant, p=lanes.p[0]))
    start = Equilibrium(lanes.null.x[0], lanes.null.u[0], 0.0)
    f = sampled_frequencies(sweep.low, sweep.high, sweep.points, period)
    sine = closed_loop_sine(engine, rig, lambda: spec.build(period), start, f, amplitude)
    response = np.asarray(sine.response[task.signal.name], complex)
    hunting = None
    if quick and task.scenario.arrives is not None:
        calm = step_part(lanes, spec.build(period), replace(task, seed=None))
        size = task.scenario.size
        share = HUNTING if size else 1.0
        hunting = hunting_lanes(period, calm.y, size or 1.0, share)
    return AfterPart(amplitude, sine.f, response, np.asarray(sine.saturated, bool), hunting)
