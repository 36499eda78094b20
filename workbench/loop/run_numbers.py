"""What a run cost: energy from the supply, the force error of a specimen's moving far end, and how long its controller
computed: by the clock of a loop in Python; for a compiled one, played again to it alone.
"""

from dataclasses import dataclass
from time import perf_counter_ns

import numpy as np

from ..base.signals import port_pressures
from ..control.controller_spec import ControllerSpec
from ..plant.valve.supply import supply_power
from ..rigs.rig import Rig
from .sampled_loop import LoopRun
from .scenarios import Scenario

_STEADY = 0.1  # s: over which a force error is a mean


@dataclass(frozen=True)
class SupplyEnergy:
    """Energy [J] that the main lands took over a run, and its part beyond the leakage at the start; None of a
    linear plant, which has no supply."""

    energy_j: float | None
    beyond_rest_j: float | None


def supply_energy(rig: Rig, run: LoopRun) -> SupplyEnergy:
    """Energy of a run that starts at rest: the integral of `supply_power`, so without the pilot's flow."""
    if not rig.is_jack:
        return SupplyEnergy(None, None)
    t, signals = run.record.t, run.record.signals
    power = supply_power(rig, signals["spool"], *port_pressures(signals), signals["supply"])
    energy = float(np.trapezoid(power, t))
    return SupplyEnergy(energy, energy - float(power[0] * (t[-1] - t[0])))


def error_per_speed(scenario: Scenario, run: LoopRun) -> float | None:
    """Force error [N] that a far end at constant speed adds, over that speed [m/s]; None for a loop that tripped.

    `scenario` is one with a `travel`. Means over the last 0.1 s before the far end leaves and before it slows down.
    """
    if run.tripped is not None:
        return None
    t, signals = run.record.t, run.record.signals
    speed = scenario.inputs(t)["specimen_velocity"]
    leaves, slows = t[np.flatnonzero(speed > 0)[0]], t[np.flatnonzero(speed > 0.999 * scenario.speed)[-1]]
    error = signals["reference"] - signals["force"]
    standing, moving = (np.mean(error[(t > end - _STEADY) & (t < end)]) for end in (leaves, slows))
    return float((moving - standing) / scenario.speed)


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
