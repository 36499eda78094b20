"""What a step of N lanes gave, whichever core made it, and the protocol of cores."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol, TypeVar

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


class LaneCore(Protocol):
    """The episodes of N lanes, which share nothing: each is a function of its generator and its actions."""

    def reset(self, random: Sequence[np.random.Generator], lanes: np.ndarray | None = None) -> Stepped:
        """`restart`; what is random, in the episodes to come too, is drawn from `random` [N]."""
        ...

    def step(self, actions: np.ndarray) -> Stepped:
        """One step with actions [N], or [N, 6]. A lane whose episode was over begins its next one instead."""
        ...

    def restart(self, lanes: np.ndarray) -> Stepped:
        """Begin an episode in the lanes of a mask [N], or of None in all; the others stay where they are."""
        ...

    def reasons(self, lanes: np.ndarray) -> list[str]:
        """Why the lanes of a mask [N] or numbers were terminated, in words."""
        ...


class JackCore(LaneCore, Protocol):
    """The same of one jack, which can be drawn."""

    @property
    def present(self) -> Present:
        """How the first lane is now."""
        ...


CoreT = TypeVar("CoreT", bound=LaneCore)
JackCoreT = TypeVar("JackCoreT", bound=JackCore)
