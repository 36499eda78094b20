"""Whether an object keeps the protocol of a controller, as far as that can be seen before a loop runs."""

from inspect import signature
from typing import Any

from ..base.errors import InputError, nearest
from ..base.signals import SIGNALS

_METHODS = {
    "reset": ("reference", "measurement", "command"),
    "compute": ("reference", "measurement"),
    "update": ("realised",),
}


def check_controller(controller: Any, where: str) -> None:
    """Raises InputError, opened by `where`, with class and method, for what no loop can run."""
    name = type(controller).__name__
    for method, arguments in _METHODS.items():
        call = f"{method}({', '.join(arguments)})"
        if not callable(getattr(controller, method, None)):
            raise InputError(f"{where}: {name} has no method {method}; give it {call}")
        try:
            signature(getattr(controller, method)).bind(*arguments)
        except TypeError as error:
            raise InputError(f"{where}: {name}.{method}: {error}; a loop calls {call}") from None
    measures = getattr(controller, "measures", None)
    if not isinstance(measures, tuple | list) or not measures or not all(isinstance(s, str) for s in measures):
        raise InputError(
            f"{where}: {name}.measures: {measures!r}; write a tuple of the signals that it needs, the controlled one "
            'first, such as ("position",)'
        )
    for signal in measures:
        if signal not in SIGNALS:
            raise InputError(f'{where}: {name}.measures: no signal "{signal}"; {nearest(signal, list(SIGNALS))}')
