"""Pump drives that turn by a measured speed, and runs of them from rest."""

import numpy as np

from workbench.engine import Engine
from workbench.plant import Plant, build
from workbench.rigs.rig import Rig

Driven = tuple[Plant, Engine]


def driven_by_speed(rig: Rig) -> Driven:
    """Plant and engine of a rig whose shaft turns as measured."""
    plant = build(rig.with_corrector("speed"))
    return plant, Engine(plant, 1e-7)


def run(driven: Driven, seconds: float, **inputs: float) -> tuple[np.ndarray, dict, dict]:
    """Times, states and outputs by name of a run from rest with direction valves shut, inputs held."""
    plant, engine = driven
    x0 = plant.start.copy()
    for opening in ("oa", "ob"):
        if opening in [state.name for state in plant.states]:
            x0[plant.state(opening)] = 0.0
    t = np.linspace(0, seconds, 201)
    u = np.zeros((len(t), len(plant.inputs)))
    for name, value in inputs.items():
        u[:, plant.input(name)] = value
    trajectory = engine.run(x0, t, u)
    assert trajectory.failed_at is None
    states = {state.name: trajectory.x[:, i] for i, state in enumerate(plant.states)}
    return t, states, dict(zip(plant.outputs, engine.outputs(trajectory.x, u).T, strict=True))
