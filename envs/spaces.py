"""The spaces of one jack, and what its reset accepts."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from workbench.base.errors import InputError

from .observation import BOUND, ObservedChannel


def action_space() -> Box:
    """The demanded spool command [1]."""
    return Box(-1.0, 1.0, (1,), np.float32)


def observation_space(channels: Sequence[ObservedChannel]) -> Box:
    """The channels over their full scales [1]."""
    return Box(-BOUND, BOUND, (len(channels),), np.float32)


def refuse_options(options: Mapping[str, Any] | None) -> None:
    """Raise InputError for reset options: there are none."""
    if options:
        raise InputError(f'reset: unknown option "{next(iter(options))}"; a task file says all, so leave options out')
