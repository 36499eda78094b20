"""A CasADi function evaluated where its arguments stand: conversions would take longer than a small one does."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np


class BufferedFunction:
    """A function in fixed places: `given` [argument by argument], `found` of its first result. `evaluate` reads and
    writes these and nothing else, column by column where they are matrices; one thread at a time.

    Places that are not given are its own.
    """

    evaluate: Callable[[], None]

    def __init__(self, function: ca.Function, *given: np.ndarray, found: np.ndarray | None = None) -> None:
        own = [np.zeros(function.numel_in(i)) for i in range(len(given), function.n_in())]
        self.given = [*given[: function.n_in()], *own]
        self.found = np.zeros(function.numel_out(0)) if found is None else found
        buffer: Any = function.buffer()
        self._buffer, self.evaluate = buffer
        for i, argument in enumerate(self.given):
            if len(argument):
                self._buffer.set_arg(i, argument.data)
        if len(self.found):
            self._buffer.set_res(0, self.found.data)

    def __call__(self, *arguments: np.ndarray | float) -> np.ndarray:
        """The result, in an array that is that of every call."""
        for own, argument in zip(self.given, arguments, strict=True):
            own[...] = argument
        self.evaluate()
        return self.found
