"""The choice of the back end: machine code where this machine and the graph allow it, else a reason why not."""

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from .emit import first_unsupported
from .jobs import Stepping

if TYPE_CHECKING:
    from .compiled import CompiledPlant


class NotCompiled(RuntimeError):
    """Says in one line why a plant runs through the interpreter."""


def compile_plant(
    attempt: ca.Function,
    outputs: ca.Function,
    p: np.ndarray,
    stepping: Stepping,
    brief: bool = False,
    commands: int = 1,
) -> "CompiledPlant":
    """Machine code for an attempt (s, u, p, tolerance) -> s and for outputs (x, u, p) -> y.

    `p` are the parameters where a run gives none; `brief` and `commands` as CompiledPlant has them. Raises NotCompiled
    for an operation that has no compiled form, and where the compiler is missing or does not work.
    """
    for function in (attempt, outputs):
        if operation := first_unsupported(function):
            raise NotCompiled(f'interpreted: the operation "{operation}" has no compiled form')
    try:
        from .compiled import CompiledPlant

        return CompiledPlant(attempt, outputs, p, stepping, brief, commands)
    except (ImportError, OSError, RuntimeError) as error:
        raise NotCompiled(f"interpreted: no compiler here ({error})") from error
