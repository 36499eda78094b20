"""Many jacks side by side as a Gymnasium vector environment: a shell over a core of as many lanes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Generic

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from workbench.base.errors import InputError

from .core import Core
from .episodes import EpisodesT, Stepped
from .one_lane import action_space, checked_action, observation_space, refuse_options, refuse_render_mode
from .task import load_task

_NEXT_STEP = AutoresetMode.NEXT_STEP


class LaneVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray], Generic[EpisodesT]):
    """What all of them share: a shell over a core of `num_envs` lanes, with the observations of one."""

    core: EpisodesT

    def _wrap(
        self, core: EpisodesT, num_envs: int, observation: Box, action: Box, autoreset_mode: AutoresetMode
    ) -> None:
        self.core, self.num_envs, self.autoreset_mode = core, num_envs, autoreset_mode
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self.single_action_space = action
        self.single_observation_space = observation
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        size = int(np.prod(self.single_action_space.shape))
        self._shape = (num_envs, size) if size > 1 else (num_envs,)
        self._random: list[np.random.Generator] = []
        self._ended = np.zeros(num_envs, bool)  # lanes that wait for their caller's reset

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in every lane. An int seeds lane i with seed + i, a sequence each lane; None goes on.

        options={"reset_mask": mask}, bool [num_envs], begins one in these lanes only. Raises InputError for a mask that
        is none, for other options, and for a sequence of another length than num_envs.
        """
        there = self._masked_lanes(options)
        seeds: Sequence[int | None] = [None] * self.num_envs
        if seed is not None:
            seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        if len(seeds) != self.num_envs:
            raise InputError(
                f"reset: {len(seeds)} seeds for {self.num_envs} lanes; give one a lane, or a single number"
            )
        before = self._random or [None] * self.num_envs
        self._random = [
            seeding.np_random(new)[0] if old is None or (mine and new is not None) else old
            for old, new, mine in zip(before, seeds, there.tolist(), strict=True)
        ]
        begun = self.core.reset(self._random, there)
        self._ended &= ~there
        return begun.observation, self._infos(begun, there)

    def _masked_lanes(self, options: Mapping[str, Any] | None) -> np.ndarray:
        """The lanes that a reset with these options begins anew, bool [num_envs]."""
        options = dict(options or {})
        mask = np.asarray(options.pop("reset_mask", np.ones(self.num_envs, bool)))
        refuse_options(options)
        if mask.dtype != bool or mask.shape != (self.num_envs,) or not mask.any():
            raise InputError(f"reset: reset_mask must be {self.num_envs} times True or False, at least once True")
        if not (self._random or mask.all()):
            raise InputError("reset: reset_mask leaves out lanes that have no episode yet; reset them all first")
        return mask

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One step of every lane with actions [num_envs, own]; see Gymnasium. Raises ResetNeeded before a reset, of all
        lanes or, where nothing else resets them, of those that ended; InputError for actions of another shape."""
        if not self._random:
            raise ResetNeeded("no episode is going on; call reset() first")
        if self._ended.any():
            lane = np.flatnonzero(self._ended)[0]
            raise ResetNeeded(f'the episode of lane {lane} is over; call reset(options={{"reset_mask": mask}}) first')
        stepped = self.core.step(checked_action(actions, self.action_space).reshape(self._shape))
        ended = stepped.terminated | stepped.truncated
        if self.autoreset_mode is AutoresetMode.DISABLED:
            self._ended = ended.copy()
        if self.autoreset_mode is not AutoresetMode.SAME_STEP or not np.count_nonzero(ended):
            return *stepped[:4], self._infos(stepped)
        final = {**self._final(stepped, ended), **_masked("final_info", self._infos(stepped, ended), ended)}
        begun = self.core.restart(ended)
        return begun.observation, *stepped[1:4], {**final, **self._infos(begun)}

    def render(self) -> None:
        """None: lanes are not drawn."""

    def _infos(self, stepped: Stepped, lanes: np.ndarray | None = None) -> dict[str, Any]:
        """Arrays over the lanes, each with its mask, as Gymnasium has them; of all lanes or of those of a mask, 0 in
        the others."""
        there = np.ones(self.num_envs, bool) if lanes is None else lanes
        infos = {}
        for name, values in stepped.infos.items():
            own = there if values.ndim == 1 else there[:, None]
            infos |= _masked(name, np.where(own, values, values.dtype.type(0)), there)  # a copy: cores go on from it
        ended = stepped.terminated
        if np.count_nonzero(ended):
            trip = np.full(self.num_envs, None, dtype=object)
            trip[ended] = self.core.reasons(ended)
            infos |= _masked("trip", trip, ended)
        return infos

    def _final(self, stepped: Stepped, ended: np.ndarray) -> dict[str, Any]:
        """The last observations of the lanes that ended, None of the others."""
        final = np.full(self.num_envs, None, dtype=object)
        for lane in np.flatnonzero(ended):
            final[lane] = stepped.observation[lane]
        return _masked("final_obs", final, ended)


def _masked(name: str, values: Any, lanes: np.ndarray) -> dict[str, Any]:
    """An entry of infos, and the mask of the lanes that it is of."""
    return {name: values, f"_{name}": lanes.copy()}


def autoreset(mode: str | AutoresetMode) -> AutoresetMode:
    """Raises InputError for a mode that is unknown."""
    for each in AutoresetMode:
        if mode in (each, each.value):
            return each
    raise InputError(f"autoreset_mode = {mode!r}: must be {' or '.join(repr(each.value) for each in AutoresetMode)}")


def checked_lanes(num_envs: int) -> int:
    """Raises InputError for less than one."""
    if num_envs < 1:
        raise InputError(f"num_envs = {num_envs}: must be 1 or more")
    return num_envs


class _Jacks(LaneVectorEnv[Core]):
    """What both loops share."""

    loop: ClassVar[str]

    def __init__(
        self, num_envs: int, task: str | Path, autoreset_mode: str | AutoresetMode, render_mode: str | None
    ) -> None:
        refuse_render_mode(render_mode)
        mode, core = autoreset(autoreset_mode), Core(load_task(task, self.loop), checked_lanes(num_envs))
        self._wrap(core, num_envs, observation_space(core.channels), action_space(), mode)


class JackPositionVector(_Jacks):
    """JackPosition over `num_envs` lanes: lane i does what JackPosition with the same seed does, bit for bit.

    `autoreset_mode` says when a lane whose episode has ended begins its next one. AutoresetMode.NEXT_STEP: in the step
    after, which ignores its action and gives the first observation, reward 0 and no end. AutoresetMode.SAME_STEP: in
    the step that ended it, which gives the first observation; `infos` then has `final_obs` and `final_info`, with their
    masks. AutoresetMode.DISABLED: when you ask for it, by `reset(options={"reset_mask": ended})`; until then a step
    raises ResetNeeded. Raises InputError for another mode, and for a `render_mode`: lanes are not drawn.
    """

    loop = "position"

    def __init__(
        self,
        num_envs: int = 1,
        task: str | Path = "position",
        autoreset_mode: str | AutoresetMode = _NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(num_envs, task, autoreset_mode, render_mode)


class JackForceVector(_Jacks):
    """JackForce over `num_envs` lanes; see JackPositionVector."""

    loop = "force"

    def __init__(
        self,
        num_envs: int = 1,
        task: str | Path = "force",
        autoreset_mode: str | AutoresetMode = _NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(num_envs, task, autoreset_mode, render_mode)
