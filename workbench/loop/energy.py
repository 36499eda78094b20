"""The energy that a run draws from the supply."""

from dataclasses import dataclass

import numpy as np

from ..plant.valve.supply import supply_power
from ..rigs.rig import Rig
from .sampled_loop import LoopRun


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
    power = supply_power(rig, *(signals[name] for name in ("spool", "pa", "pb", "supply")))
    energy = float(np.trapezoid(power, t))
    return SupplyEnergy(energy, energy - float(power[0] * (t[-1] - t[0])))
