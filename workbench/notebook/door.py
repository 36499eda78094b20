"""Functions as the door shows them: a rig serves where a plant is asked for, all else is refused in one line."""

from collections.abc import Callable
from dataclasses import MISSING, fields
from functools import cache, wraps
from inspect import Parameter, signature
from typing import Any

from ..base.asked import asks
from ..base.errors import InputError, nearest
from ..commands.common.declared import Experiment, keys_of
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


def takes_keys(kind: type[Experiment]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A function that makes an experiment of a kind takes, by name, each key with a default that it does not name."""
    keys = keys_of(kind)
    free = {each.name: each.default for each in fields(kind) if each.default is not MISSING and keys[each.name].check}

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        *own, _keys = (each for each in signature(function).parameters.values())
        more = {name: default for name, default in free.items() if name not in {each.name for each in own}}

        @wraps(function)
        def call(*given: Any, **named: Any) -> Any:
            for name in named:
                if name not in (known := [*(each.name for each in own), *more]):
                    raise InputError(f'{function.__name__}: no "{name}"; {nearest(name, known)}')
            return function(*given, **named)

        further = [Parameter(name, Parameter.KEYWORD_ONLY, default=default) for name, default in more.items()]
        vars(call)["__signature__"] = signature(function).replace(parameters=[*own, *further])
        return call

    return decorate
