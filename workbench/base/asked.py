"""Whether a function is given the kinds of things that its annotations ask for, said in one line.

Only kinds that can be told apart are checked: this package's classes, text, paths, numbers, arrays, and sequences of
these. What is annotated as anything else is the function's own affair.
"""

import builtins
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from inspect import Parameter, signature
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from .errors import InputError

Convert = Callable[[type, Any], Any]
"""Takes the kind that is asked for and what was given instead; gives what serves, or None."""

_NAMES = {
    np.ndarray: "an array",
    str: "text",
    Path: "a path",
    float: "a number",
    int: "a whole number",
    bool: "True or False",
}
_ABLE = {float: Real, int: Real, Path: PathLike}


def asks(function: Callable[..., Any], convert: Convert, names: Mapping[str, type]) -> Callable[..., Any]:
    """The function, which raises InputError for an argument of another kind than is asked for and none that
    `convert` makes of it. `names` are classes that it names in annotations and does not import."""

    @wraps(function)
    def checked(*given: Any, **named: Any) -> Any:
        hints = get_type_hints(function, localns=_Names(function.__globals__, names))
        bound = signature(function).bind(*given, **named)
        for name, value in bound.arguments.items():
            kind = signature(function).parameters[name].kind
            if name in hints and kind not in (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD):
                bound.arguments[name] = _asked(function.__name__, name, hints[name], value, convert)
        return function(*bound.args, **bound.kwargs)

    return checked


class _Anything(type):
    def __getattr__(cls, name: str) -> Any:
        return cls


class _Unchecked(metaclass=_Anything):
    """A kind that nobody imported: anything is one."""


class _Names(dict[str, Any]):
    """What annotations name: what is nowhere is a kind that is not checked."""

    def __init__(self, known: Mapping[str, Any], further: Mapping[str, type]) -> None:
        super().__init__({**vars(builtins), **known, **further})

    def __missing__(self, name: str) -> Any:
        return _Unchecked


def _asked(function: str, name: str, hint: Any, value: Any, convert: Convert) -> Any:
    kinds = get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)
    if not all(map(_is_known, kinds)) or any(_fits(kind, value) for kind in kinds):
        return value
    for kind in kinds:
        if (made := convert(kind, value)) is not None:
            return made
    wanted = " or ".join(dict.fromkeys(_name(kind) for kind in kinds if kind is not types.NoneType))
    raise InputError(f"{function}: {name} is {_described(value)}; give {wanted}")


def _is_known(kind: Any) -> bool:
    origin = get_origin(kind)
    if origin in (Sequence, Iterable, list, tuple):
        return all(map(_is_known, [part for part in get_args(kind) if part is not ...]))
    if not isinstance(kind, type) or origin is not None:
        return False
    if kind is _Unchecked:
        return False
    return kind in _NAMES or kind is types.NoneType or kind.__module__.startswith("workbench.")


def _fits(kind: Any, value: Any) -> bool:
    if kind is np.ndarray:
        return hasattr(value, "__len__") and not isinstance(value, str | Mapping)
    if get_origin(kind) is None:
        return isinstance(value, _ABLE.get(kind, kind))
    if isinstance(value, str | Mapping) or not isinstance(value, Iterable):
        return False
    parts = [part for part in get_args(kind) if part is not ...]
    return not isinstance(value, Sequence) or all(any(_fits(part, each) for part in parts) for each in value)


def _name(kind: Any) -> str:
    if get_origin(kind) is not None:
        return f"several: {', '.join(_name(part) for part in get_args(kind) if part is not ...)}"
    return _NAMES.get(kind) or f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"


def _described(value: Any) -> str:
    if value is None:
        return "None"
    text = " ".join(repr(value).split())
    shown = f" ({text})" if isinstance(value, str | int | float) and len(text) < 40 else ""
    kind = type(value).__name__
    return f"{'an' if kind[0] in 'AEIOUaeiou' else 'a'} {kind}{shown}"
