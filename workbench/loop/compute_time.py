"""How long a controller computes: by the clock of a loop in Python; for a compiled one, played again to it alone."""

from time import perf_counter_ns

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..rigs.rig import Rig
from .sampled_loop import LoopRun


def computing(spec: ControllerSpec, rig: Rig, run: LoopRun) -> np.ndarray:
    """Time [us] of each sample [k] of a course that the controller was asked for."""
    if run.compute_us is not None:
        return run.compute_us
    controller, signals = spec.build(rig.period.value), run.record.signals
    columns = [signals[name].tolist() for name in controller.measures]
    measurements = [dict(zip(controller.measures, values, strict=True)) for values in zip(*columns, strict=True)]
    reference, sent = signals["reference"].tolist(), signals["command"].tolist()
    controller.reset(measurements[0][controller.measures[0]], measurements[0], float(signals["command"][0]))
    spent = []
    for k, asked in enumerate(reference):
        began = perf_counter_ns()
        controller.compute(asked, measurements[k])
        controller.update(sent[k])
        spent.append((perf_counter_ns() - began) / 1e3)
    return np.array(spent)


def summary(spent: np.ndarray, period: float) -> dict[str, float | int]:
    """Median and 99th percentile [us], and how many samples took longer than the control period [s]."""
    p50, p99 = np.percentile(spent, (50, 99))
    return {"solve_p50_us": float(p50), "solve_p99_us": float(p99), "late": int((spent > period * 1e6).sum())}
