"""What a CRONE design asks of its plant: JackModel and LinearModel have it."""

from typing import Protocol

import numpy as np

from ...linear.state_space import StateSpace


class DesignPlant(Protocol):
    """A plant from command to position, as a sampled loop sees it."""

    @property
    def modes(self) -> np.ndarray:
        """Poles [rad/s] that a law cancels."""
        ...

    @property
    def zeros(self) -> np.ndarray:
        """Zeros [rad/s] that a law cancels."""
        ...

    @property
    def integrators(self) -> int:
        """How many poles are 0."""
        ...

    def response(self, f: np.ndarray) -> np.ndarray:
        """position/command at f [k] in Hz, complex [k] in m."""
        ...

    def stable(self, law: StateSpace) -> bool:
        """Whether the loop of a discrete law (error -> command) on it is stable."""
        ...
