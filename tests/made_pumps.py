"""Pump drives: runs of them from rest, the oil in them, and where they stand or move steadily."""

from collections.abc import Iterator

import numpy as np
import pytest

from workbench.engine import Engine
from workbench.linear import equilibrium, linearise
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


def oil_beyond_motion(rig: Rig, x: dict) -> tuple[np.ndarray, np.ndarray]:
    """Oil [m^3] of accumulator, low side, delivery and chambers, less what the rod displaces, and that: states by
    name."""
    half, moved = rig["S"] / 2, (rig["AA"] - rig["AB"]) * x["x"]
    stored = (rig["V0A"] + rig["AA"] * (half + x["x"]), rig["V0B"] + rig["AB"] * (half - x["x"]))
    rates = [volume / rig["beta"] * np.gradient(x[name]) for volume, name in zip(stored, ("P1", "P2"), strict=True)]
    pressed = rig["Vs"] * x["P0"] + (rig["Vp"] * x["Pd"] if "Pd" in x else 0.0)
    gas = rig["Vg"] * (rig["pg"] / x["Pg"]) ** (1 / rig["kg"])
    return pressed / rig["beta"] - gas + np.cumsum(np.sum(rates, axis=0)) + moved, moved


def poles_of_steady_points(rig: Rig, corrector: str) -> Iterator[tuple[float, np.ndarray]]:
    """Speed and sorted real parts of the poles, at rest and moving both ways; nothing changes there but the stores."""
    plant = build(rig.with_corrector(corrector))
    balanced = [i for i, state in enumerate(plant.states) if state.name not in ("x", "Pg")]
    for speed in (0.0, rig.passing_speed, -rig.passing_speed):
        point = equilibrium(plant, speed=speed)
        rates = np.array(plant.f(point.x, point.u, plant.p)).ravel() / plant.scale
        assert rates[balanced] == pytest.approx(0, abs=1e-3)
        assert point.speed == speed
        yield speed, np.sort(np.real(linearise(plant, point, outputs=("position",)).poles()))
