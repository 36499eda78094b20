"""The spaces of one jack, and what resets, steps and constructors accept."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Space

from workbench.base.errors import InputError

from .observation import BOUND, ObservedChannel


def action_space() -> Box:
    """The demanded spool command [1]."""
    return Box(-1.0, 1.0, (1,), np.float32)


def observation_space(channels: Sequence[ObservedChannel]) -> Box:
    """The channels over their full scales [1]."""
    return Box(-BOUND, BOUND, (len(channels),), np.float32)


def checked_action(action: Any, space: Space[Any]) -> np.ndarray:
    """As numbers of the space's shape. Raises InputError for another shape, and for what is no numbers."""
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
