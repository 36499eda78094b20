"""What a step of N lanes gave, whichever core made it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np


class Stepped(NamedTuple):
    """What a step of N lanes gave; every array is new.

    `error` [N] is the true one in m or N, `command` [N] the realised one, both [N, 6] of a platform; `more`: further
    numbers [N] for infos.
    """

    observation: np.ndarray
    reward: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    error: np.ndarray
    command: np.ndarray
    more: Mapping[str, np.ndarray] = {}

    @property
    def infos(self) -> dict[str, np.ndarray]:
        """By name, [N]."""
        return {"error": self.error, "command": self.command, **self.more}


class Present(NamedTuple):
    """How the first lane is now, true: reference and controlled signal [m or N], position [m], command [1]."""

    reference: float
    controlled: float
    position: float
    command: float
