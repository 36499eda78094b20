"""Functions as the door shows them: a rig serves where a plant is asked for, all else is refused in one line."""

from collections.abc import Callable
from functools import cache
from typing import Any

from ..base.asked import asks
from ..plant import Plant, build
from ..rigs.linear_rig import LinearRig
from ..rigs.rig import Rig


@cache
def shown(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which raises InputError that says what it wants where it is given something else."""
    return asks(function, _served, {"Plant": Plant, "Rig": Rig})


def _served(kind: Any, given: Any) -> Any:
    if kind is Plant and isinstance(given, Rig | LinearRig):
        return build(given)
    return given if kind is Rig and isinstance(given, LinearRig) else None
