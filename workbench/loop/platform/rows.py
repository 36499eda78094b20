"""What is measured on a platform's loops: steps along one axis with what the others do meanwhile, and the power."""

from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...control.platform_controller import LEGS
from ...linear.crossings import corner_frequency
from ...plant.valve.supply import supply_power
from ...rigs.platform import AXES
from .. import step_metrics as metrics
from .loop import PlatformRun
from .setup import PlatformSetup
from .steps import AxisStep
from .transfer import PlatformTransfer

SHARE = 0.02  # of a step: its settling band


def step_row(
    controller: str, step: AxisStep, setup: PlatformSetup, run: PlatformRun, transfer: PlatformTransfer
) -> dict[str, Any]:
    """The row of a step in metrics.json: as of a jack's position step, and `cross`, how far the others go meanwhile, in
    percent of the step, angles times the radius of the joints."""
    t, y = run.t, run.pose[:, step.axis]
    band, whole = SHARE * abs(step.size), run.tripped is None
    own = transfer.transfer[:, step.axis, step.axis]
    weights = setup.platform.geometry.weights
    moved = np.abs(run.pose - run.pose[0]).max(axis=0) * weights
    percent = 100 * moved / (abs(step.size) * weights[step.axis])
    return {
        "controller": controller,
        "rig": setup.platform.name,
        "scenario": step.name,
        "settling_s": metrics.settling_time(t, y, step.size, band) if whole else None,
        "overshoot_percent": metrics.overshoot(y, 0.0, step.size) if whole else None,
        "rise_s": metrics.rise_time(t, y, 0.0, step.size) if whole else None,
        "steady_state_error": metrics.steady_state_error(t, y, step.size) if whole else None,
        "iae": metrics.iae(t, y, step.size) if whole else None,
        "peak_command": float(np.abs(run.demanded).max()),
        "saturated_s": max(metrics.saturated_time(t, run.demanded[:, i], run.sent[:, i]) for i in range(LEGS)),
        "cavitation_s": metrics.cavitation_time(t, run.signals["lowest_pressure"]),
        "residual_oscillation": metrics.residual_oscillation(t, y, step.size) if whole else None,
        "stable": transfer.stable,
        "tripped": run.tripped,
        "f3db_hz": corner_frequency(transfer.f, gain_db(own), -3.0) if transfer.stable else None,
        "f90_hz": corner_frequency(transfer.f, phase_deg(own), -90.0) if transfer.stable else None,
        "peak_db": float(gain_db(own).max()) if transfer.stable else None,
        "gain_margin_db": None,
        "phase_margin_deg": None,
        "ms": float(transfer.sensitivity.max()) if transfer.stable else None,
        "band": band,
        "cross": {axis: float(percent[i]) for i, axis in enumerate(AXES) if i != step.axis},
        **power(setup, run),
    }


def power(setup: PlatformSetup, run: PlatformRun) -> dict[str, float]:
    """Largest power [W] and energy [J] that the main lands of all jacks draw in a run."""
    total = np.zeros(len(run.t))
    for i, leg in enumerate(setup.platform.legs):
        signals = (run.signals[f"leg{i + 1}.{name}"] for name in ("spool", "pa", "pb", "supply"))
        total += supply_power(leg.rig, *signals)
    return {"peak_power_w": float(total.max()), "energy_j": float(np.trapezoid(total, run.t))}
