"""The rig of a drawn campaign, played: a position loop that writes coarse commands, and a plant that may be late."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ....base.errors import InputError
from ....engine import DelayLine, Engine
from ....linear import equilibrium
from ....records.excitation import Excitation

QUANTUM = 1 / 32767  # of full command: a drive of 16 bits


@dataclass(frozen=True)
class PlayedMotion:
    """What a rig did, sample by sample: true states and outputs by name, [n] SI, and the written command [n]."""

    states: dict[str, np.ndarray]
    outputs: dict[str, np.ndarray]
    command: np.ndarray


def start(engine: Engine, p: np.ndarray, initial_states: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """State and inputs at rest at mid stroke; `initial_states` are states that begin elsewhere."""
    rest = equilibrium(engine.plant, p=p)
    x = rest.x.copy()
    for name, value in initial_states.items():
        x[engine.plant.state(name)] = value
    return x, rest.u


def play(
    engine: Engine,
    p: np.ndarray,
    begin: tuple[np.ndarray, np.ndarray],
    played: Excitation,
    gain: float,
    noise: np.ndarray,
) -> PlayedMotion:
    """Follow the reference by `gain` [1/m] times the error of a position read with `noise` [n] m.

    The loop runs here and not in SampledLoop because a late plant meets another command than the one that was written,
    which is the one that is recorded. Raises InputError where the plant cannot be simulated.
    """
    plant, period, steps = engine.plant, played.period, len(played.reference)
    place, middle = plant.state("x"), p[plant.parameters.index("xmid")]
    x, inputs = begin[0], begin[1].copy()
    line = DelayLine(plant.lateness(p), period, inputs[0], plant.interpolated)
    states, met, written = np.empty((steps, plant.n)), np.empty(steps), np.empty(steps)
    for k in range(steps):
        states[k] = x
        error = played.reference[k] - (x[place] + middle + noise[k])
        demanded = min(1.0, max(-1.0, gain * error + played.command[k]))
        written[k] = round(demanded / QUANTUM) * QUANTUM
        arriving = line.send(written[k])
        met[k] = arriving[0][0]
        for inputs[0], share in arriving:
            after = engine.advance(x, inputs, share * period, p)
            if after is None:
                raise InputError(f"{played.name}: {plant.name} cannot be simulated beyond {k * period:.3f} s")
            x = after
    u = np.tile(begin[1], (steps, 1))
    u[:, 0] = met
    outputs = engine.outputs(states, u, p)
    return PlayedMotion(
        {state.name: states[:, i] for i, state in enumerate(plant.states)},
        {name: outputs[:, i] for i, name in enumerate(plant.outputs)},
        written,
    )
