"""Loops that are run once."""

import numpy as np

from workbench.control.protocol import Controller
from workbench.engine import Engine
from workbench.linear import Equilibrium
from workbench.loop.sampled_loop import LoopRun, SampledLoop
from workbench.rigs.rig import Rig


def run_loop(
    engine: Engine, rig: Rig, controller: Controller, start: Equilibrium, reference: np.ndarray, seed: int | None = None
) -> LoopRun:
    """Once over `reference` [k]."""
    return SampledLoop(engine, rig, controller, start, seed).run(reference)
