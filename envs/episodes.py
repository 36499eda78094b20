"""The episodes of N loops side by side, whatever is asked of them: when they begin, go on and end, and what a step
gives.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from workbench.loop.guard_numbers import trip_reason
from workbench.loop.sampled_loop import SIMULATION_FAILED
from workbench.rigs.rig import Rig

from .loops import LaneLoops


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


class LaneEpisodes(ABC):
    """Steps N lanes of loops. Lanes share nothing: each is a function of its generator and its actions.

    A lane's episode may have a course, `times` rows of what comes in, period by period: rows `now` [N, j] of those of
    all lanes belong to the periods of its next step. `waiting` [N]: whose episode is over. `trip_costs`: the reward
    that a termination takes away.
    """

    trip_costs: float

    def _allocate(self, loops: LaneLoops, steps: int) -> None:
        """For episodes of so many steps."""
        lanes, periods = loops.periods
        self.loops, self._failed, self._waiting = loops, np.zeros(lanes, bool), np.ones(lanes, bool)
        self.times = (steps + 1) * periods + 1  # one step more: a lane that waits for its reset has a time too
        self._first = np.arange(lanes)[:, None] * self.times + np.arange(periods)
        self._now, self._last = self._first.copy(), self._first[:, 0] + steps * periods
        self._random: Sequence[np.random.Generator] = ()

    def reset(self, random: Sequence[np.random.Generator], lanes: np.ndarray | None = None) -> Stepped:
        """`restart`; what is random, in the episodes to come too, is drawn from `random` [N]."""
        self._random = random
        return self.restart(lanes)

    def restart(self, lanes: np.ndarray | None = None) -> Stepped:
        """Begin an episode in the lanes of a mask [N], or of None in all; the others stay where they are."""
        nothing = np.zeros(len(self._now))
        begun = nothing == 0 if lanes is None else lanes
        self._start(begun)
        self._waiting = self._waiting & ~begun
        self._measure()
        return self._stepped(nothing, nothing > 0, nothing > 0)

    def step(self, actions: np.ndarray) -> Stepped:
        """One step with actions [N] or [N, 6]. A lane whose episode was over begins its next one instead."""
        begun, before = self._waiting, self.loops.command.copy()
        self._failed = self._play(actions)
        self._now += self._now.shape[1]
        if some_begin := np.count_nonzero(begun):
            self._start(begun)
        self._measure()
        reward = self._reward(before, begun)
        terminated, truncated = self._failed | self._stopped(), self._now[:, 0] >= self._last
        if some_begin or np.count_nonzero(terminated):
            terminated &= ~begun
            truncated &= ~terminated
            reward = np.where(begun | self._failed, 0.0, reward) - self.trip_costs * terminated
        self._waiting = terminated | truncated
        return self._stepped(reward, terminated, truncated)

    def _start(self, begun: np.ndarray) -> None:
        rows = np.flatnonzero(begun)
        self._now[rows], self._failed[rows] = self._first[rows], False
        if len(rows):
            self._begin(rows)

    @abstractmethod
    def reasons(self, lanes: np.ndarray) -> list[str]:
        """Why the lanes of a mask [N] or numbers were terminated, in words."""

    @abstractmethod
    def _begin(self, rows: np.ndarray) -> None:
        """New episodes in these lanes."""

    @abstractmethod
    def _play(self, actions: np.ndarray) -> np.ndarray:
        """The loops go on by a step; which of them failed, bool [N]."""

    @abstractmethod
    def _measure(self) -> None:
        """Look at the lanes as they are now, and put down what comes next. A second time it finds the same."""

    @abstractmethod
    def _reward(self, before: np.ndarray, begun: np.ndarray) -> np.ndarray:
        """Rewards [N] of a step after its measurement: its drives had commands `before`; lanes that have begun [N] made
        none."""

    @abstractmethod
    def _stopped(self) -> np.ndarray:
        """Which lanes have tripped or are at an end [N]."""

    @abstractmethod
    def _stepped(self, reward: np.ndarray, terminated: np.ndarray, truncated: np.ndarray) -> Stepped:
        """What the lanes are shown now."""


class JackEpisodes(LaneEpisodes):
    """Episodes of single jacks of a rig, which can be drawn."""

    rig: Rig

    def reasons(self, lanes: np.ndarray) -> list[str]:
        """See LaneEpisodes."""
        pairs = zip(self._failed[lanes], self.loops.trip[lanes].astype(int), strict=True)
        return [SIMULATION_FAILED if failed else self._why(trip) for failed, trip in pairs]

    def _why(self, trip: int) -> str:
        return trip_reason(self.rig, trip) if trip else "the jack met its end stop"

    @property
    @abstractmethod
    def present(self) -> Present:
        """How the first lane is now."""


EpisodesT = TypeVar("EpisodesT", bound=LaneEpisodes)
JackEpisodesT = TypeVar("JackEpisodesT", bound=JackEpisodes)
