"""The rig of a drawn campaign, played: a position loop that writes coarse commands, and a plant that may be late."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.base.errors import InputError
from workbench.engine import DelayLine, Engine
from workbench.linear import equilibrium
from workbench.records.excitation import Excitation


@dataclass(frozen=True)
class PositionLoop:
    """Gain [1/m], command per error; commands are multiples of `quantum`, and below `least` the drive is off.

    `pause`: rows for which it stays off before it turns round.
    """

    gain: float
    quantum: float
    least: float = 0.0
    pause: int = 0

    def command(self, error: float, added: float) -> float:
        """Command, -1 to 1, at a position error [m]."""
        demanded = min(1.0, max(-1.0, self.gain * error + added))
        return 0.0 if abs(demanded) < self.least else round(demanded / self.quantum) * self.quantum


@dataclass(frozen=True)
class PlayedMotion:
    """What a rig did, sample by sample: true states and outputs by name, and inputs as recorded, each [n] SI."""

    states: dict[str, np.ndarray]
    outputs: dict[str, np.ndarray]
    inputs: dict[str, np.ndarray]


def start(
    engine: Engine, p: np.ndarray, initial_states: Mapping[str, float], balanced: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """State and inputs at rest at mid stroke, or as the plant starts; `initial_states` begin elsewhere."""
    plant = engine.plant
    x, u = plant.start.copy(), np.zeros(len(plant.inputs))
    if balanced:
        rest = equilibrium(plant, p=p)
        x, u = rest.x.copy(), rest.u
    for name, value in initial_states.items():
        x[plant.state(name)] = value
    return plant.following(x), u


def play(
    engine: Engine,
    p: np.ndarray,
    begin: tuple[np.ndarray, np.ndarray],
    played: Excitation,
    loop: PositionLoop,
    noise: np.ndarray,
    settings: Mapping[str, float],
) -> PlayedMotion:
    """Follow the reference by a loop that reads the position with `noise` [n] m; `settings` are further inputs, held.

    The loop runs here and not in SampledLoop because a late plant meets another command than the one that was written,
    which is the one that is recorded. Raises InputError where the plant cannot be simulated.
    """
    plant, period, steps = engine.plant, played.period, len(played.reference)
    place, middle = plant.state("x"), p[plant.parameters.index("xmid")]
    x, inputs = begin[0], begin[1].copy()
    null = inputs[0]  # the loop is trimmed
    turn = next((i for i, variable in enumerate(plant.inputs) if variable.name == "direction"), None)
    for name, value in settings.items():
        inputs[plant.input(name)] = value
    side, driven = 0.0, 0
    line = DelayLine(plant.lateness(p), period, inputs[0], plant.interpolated)
    states, met, written = np.empty((steps, plant.n)), np.empty(steps), np.empty(steps)
    for k in range(steps):
        states[k] = x
        error = played.reference[k] - (x[place] + middle + noise[k])
        written[k] = loop.command(error, null + played.command[k])
        if written[k] * side < 0 and k - driven < loop.pause:
            written[k] = 0.0
        elif written[k]:
            side, driven = np.sign(written[k]), k
        if turn is not None:
            inputs[turn] = np.sign(written[k])
        arriving = line.send(written[k])
        met[k] = arriving[0][0]
        after = engine.advance_arriving(x, inputs, arriving, period, p)
        if after is None:
            raise InputError(f"{played.name}: {plant.name} cannot be simulated beyond {k * period:.3f} s")
        x = after
    u = np.tile(inputs, (steps, 1))
    u[:, 0] = met
    recorded = {"command": written} | {name: np.full(steps, value) for name, value in settings.items()}
    if turn is not None:
        recorded["direction"] = u[:, turn] = np.sign(written)
    outputs = engine.outputs(states, u, p)
    return PlayedMotion(
        {state.name: states[:, i] for i, state in enumerate(plant.states)},
        {name: outputs[:, i] for i, name in enumerate(plant.outputs)},
        recorded,
    )
