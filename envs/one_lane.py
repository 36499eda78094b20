"""What environments share: the spaces of one jack, what resets, steps and constructors accept; and of the single ones a
shell over a core of one lane, its episode inside, and its pictures.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Generic

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box, Space

from workbench.base.errors import InputError
from workbench.rigs.rig import Rig

from .episodes import EpisodesT, JackEpisodesT, Stepped
from .observation import BOUND, ObservedChannel

if TYPE_CHECKING:
    from .picture import Film

_NOT_RENDERED: dict[str, Any] = {"render_modes": []}
_RENDERED: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 25}
FilmOf = tuple[Rig, str, float]  # rig, controlled signal, s of a step


def action_space() -> Box:
    """The demanded spool command [1]."""
    return Box(-1.0, 1.0, (1,), np.float32)


def observation_space(channels: Sequence[ObservedChannel]) -> Box:
    """The channels over their full scales [1]."""
    return Box(-BOUND, BOUND, (len(channels),), np.float32)


def checked_action(action: Any, space: Space[Any]) -> np.ndarray:
    """The action as numbers of the space's shape. Raises InputError for another shape, and for what is no numbers."""
    try:
        given = np.asarray(action, float)
    except (TypeError, ValueError):
        raise InputError(f"step: the action is no array of numbers; its shape must be {space.shape}") from None
    if given.shape != space.shape:
        raise InputError(f"step: an action of shape {given.shape}; it must be {space.shape}, as in the action space")
    return given


def refuse_render_mode(render_mode: str | None) -> None:
    """Raise InputError for the render mode of an environment that draws nothing."""
    if render_mode is not None:
        raise InputError(f"render_mode = {render_mode!r}: this environment draws no pictures; leave it out")


def refuse_options(options: Mapping[str, Any] | None) -> None:
    """Raise InputError for reset options: there are none."""
    if options:
        raise InputError(f'reset: unknown option "{next(iter(options))}"; a task file says all, so leave options out')


class OneLane(gymnasium.Env[np.ndarray, np.ndarray], Generic[EpisodesT]):
    """What all of them share: a shell over a core of one lane, the episode's inside."""

    metadata = _NOT_RENDERED
    core: EpisodesT

    def _wrap(self, core: EpisodesT, observation: Box, action: Box) -> None:
        self.core, self.observation_space, self.action_space = core, observation, action
        self._running = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; see Gymnasium. Raises InputError for options."""
        refuse_options(options)
        super().reset(seed=seed)
        begun = self.core.reset([self.np_random])
        self._running = True
        return begun.observation[0], self._info(begun)

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One step; see Gymnasium. Raises ResetNeeded when no episode is going on."""
        if not self._running:
            raise ResetNeeded("no episode is going on; call reset() first")
        return self._step(checked_action(action, self.action_space))

    def render(self) -> np.ndarray | None:
        """None: there is nothing to see of it."""
        return None

    def _step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        stepped = self.core.step(action if len(action) == 1 else action[None])
        terminated, truncated = bool(stepped.terminated[0]), bool(stepped.truncated[0])
        self._running = not (terminated or truncated)
        return stepped.observation[0], float(stepped.reward[0]), terminated, truncated, self._info(stepped)

    def _info(self, stepped: Stepped) -> dict[str, Any]:
        info: dict[str, Any] = {
            name: values[0].item() if values.ndim == 1 else values[0] for name, values in stepped.infos.items()
        }
        if stepped.terminated[0]:
            (info["trip"],) = self.core.reasons(stepped.terminated)
        return info


class OneJack(OneLane[JackEpisodesT], Generic[JackEpisodesT]):
    """One lane of one jack, which can be drawn."""

    metadata = _RENDERED

    def _wrap_jack(self, core: JackEpisodesT, observation: Box, render_mode: str | None, film: FilmOf) -> None:
        """Around a core whose film `film` makes, where `render_mode` asks for one. Raises InputError for another."""
        self._wrap(core, observation, action_space())
        self._film, self.render_mode = None, render_mode
        if render_mode is not None:
            self._film = _film(render_mode, film)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; see Gymnasium. Raises InputError for options."""
        begun = super().reset(seed=seed, options=options)
        if self._film is not None:
            self._film.begin(self.core.present)
        return begun

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One step; see Gymnasium. Raises ResetNeeded when no episode is going on."""
        answer = super().step(action)
        if self._film is not None:
            self._film.add(self.core.present)
        return answer

    def render(self) -> np.ndarray | None:
        """The jack and its signals so far [height, width, 3] in uint8; None without render_mode="rgb_array".

        Raises ResetNeeded before the first reset.
        """
        if self._film is None:
            return None
        if not self._film.begun:
            raise ResetNeeded("there is no episode to draw; call reset() first")
        return self._film.picture()


def _film(render_mode: str, film: FilmOf) -> "Film":
    if render_mode != "rgb_array":
        raise InputError(f'render_mode = {render_mode!r}: must be "rgb_array", or left out')
    from .picture import Film  # draws with matplotlib, which only pictures wait for

    return Film(*film)
