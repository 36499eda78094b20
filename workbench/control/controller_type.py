"""A kind of controller or compensator as a person calls it: `P(gain="3.7 1/m") + PressureFeedback(gain=2e-9)`."""

import inspect
import re
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from typing import Any, cast

from ..base.errors import InputError, nearest
from .controller_spec import ControllerSpec, design_class
from .load_class import absolute, load_class
from .protocol import is_number


class ControllerType:
    """A law's class by its `use`. Called with design numbers, in SI or as text with a unit, it gives a ControllerSpec.

    `Design` is the class of its numbers. Raises InputError for an unknown or a missing number, or one out of bounds.
    """

    def __init__(self, use: str) -> None:
        self._use = absolute(use, None)
        self._law = load_class(self._use, "controller")
        self.Design: Any = design_class(self._law, use)
        self.__doc__ = inspect.getdoc(self._law)
        self.__name__ = self.__qualname__ = self._law.__name__
        numbers = self._numbers.values()
        self.__signature__ = inspect.Signature(
            [inspect.Parameter(e.name, inspect.Parameter.KEYWORD_ONLY, default=_default(e)) for e in numbers],
            return_annotation=ControllerSpec,
        )

    def __call__(self, **numbers: float | str) -> ControllerSpec:
        known, name = self._numbers, self.__name__
        for key in numbers:
            if key not in known:
                raise InputError(f'{name}: no number "{key}"; {nearest(key, known)}')
        for key, entry in known.items():
            if key not in numbers and entry.default is MISSING:
                meaning, unit = entry.metadata["meaning"], entry.metadata["unit"]
                raise InputError(f"{name}: {key} is missing ({meaning}, in {unit})")
        try:
            return ControllerSpec(_words(name), self._use, self.Design(**numbers))
        except InputError as error:
            raise InputError(f"{name}: {error}") from None

    @property
    def _numbers(self) -> Mapping[str, Field[Any]]:
        return {entry.name: entry for entry in fields(cast(Any, self.Design))}

    def __repr__(self) -> str:
        """Summary, then a line for each number with its bounds, unit, default and meaning."""
        width = max(map(len, self._numbers))
        rows = [_row(entry, width) for entry in self._numbers.values()]
        return "\n".join((f"{self.__name__}: {(self.__doc__ or '').partition(chr(10))[0]}", *rows))


def controller(use: str, **numbers: float | str) -> ControllerSpec:
    """A controller or compensator of one's own, with its design numbers.

    Parameters
    ----------
    use
        "module:Class", or "file.py:Class" with a path that counts from the current folder.
    **numbers
        Its design numbers, SI or text with a unit.

    Returns
    -------
    The controller, as a loop takes it.

    Raises
    ------
    InputError
        As ControllerType raises it.
    """
    return ControllerType(use)(**numbers)


def _default(entry: Field[Any]) -> Any:
    return inspect.Parameter.empty if entry.default is MISSING else entry.default


def _row(entry: Field[Any], width: int) -> str:
    if not is_number(entry):
        return f"  {entry.name:{width}}  {entry.metadata['meaning']}"
    low, high = entry.metadata["low"], entry.metadata["high"]
    unit = "" if entry.metadata["unit"] == "1" else f" {entry.metadata['unit']}"
    default = "" if entry.default is MISSING else f", default {entry.default:g}{unit}"
    return f"  {entry.name:{width}}  {low:g} to {high:g}{unit}{default}: {entry.metadata['meaning']}"


def _words(name: str) -> str:
    """ "PidLead" as "pid-lead"."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", name).lower()
