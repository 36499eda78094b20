"""Force ports beside a program that integrates the mechanics: staggered, so that the oil keeps its damping.

The other program steps positions with speeds that it holds over its step H; then the ports follow over the same step
with these speeds held, and their forces at its end change the speeds for the next one (a leapfrog of speed against
position and pressure). A force that is one step old, as of two programs side by side, takes damping from every mode
of the oil: -w H/2, which at 23 Hz and 1 ms is three times what such a mode has. The staggered scheme adds and takes
none, moves frequencies by (w H)^2/24, and is stable while w H < 2 for the fastest mode w of the masses on the oil.
"""

import numpy as np

from ..plant import Plant
from .engine import Engine


class StaggeredPorts:
    """k force ports of one plant (`build_force_port`), moved by another program in steps of H = `step` [s].

    States x [k, n] are those at the time of the other program's positions. `command` [k] is what the drives hold.
    """

    def __init__(self, plant: Plant, x: np.ndarray, position: np.ndarray, step: float) -> None:
        self._engine, self._step = Engine(plant, brief=True), step
        self.x, self._position = np.array(x, float), np.array(position, float)

    def follow(self, position: np.ndarray, velocity: np.ndarray, command: np.ndarray) -> dict[str, np.ndarray]:
        """Go on by one step, in which the jacks came to `position` [k], m, at `velocity` [k], m/s, under commands [k];
        outputs by name [k] at its end, "force" [N] that of the rods. Raises RuntimeError where a port cannot be
        simulated."""
        middle = (self._position + position) / 2
        x, failed = self._engine.advance_batch(self.x, np.column_stack((command, middle, velocity)), self._step)
        if failed.any():
            raise RuntimeError(f"{self._engine.plant.name}: port {int(np.argmax(failed)) + 1} cannot be simulated")
        self.x, self._position = x, np.array(position, float)
        return self.outputs(position, velocity, command)

    def outputs(self, position: np.ndarray, velocity: np.ndarray, command: np.ndarray) -> dict[str, np.ndarray]:
        """Outputs of the ports by name [k], where they are."""
        outputs = self._engine.outputs(self.x, np.column_stack((command, position, velocity)))
        return dict(zip(self._engine.plant.outputs, outputs.T, strict=True))
