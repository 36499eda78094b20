"""Linear models of a plant about an operating point, as python-control systems."""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import InputError, nearest
from ..plant import Plant
from .equilibrium import Equilibrium

if TYPE_CHECKING:
    import control

PADE = 4  # order of the approximation of a delay d: 1 degree off at w d = 4.5 rad

Matrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def linearise(
    plant: Plant,
    about: Equilibrium,
    inputs: tuple[str, ...] = ("command",),
    outputs: tuple[str, ...] = ("position",),
    p: np.ndarray | None = None,
) -> "control.StateSpace":
    """x' = A x + B u, y = C x + D u about an operating point, in SI, named inputs, outputs and states.

    Pass `p = plant.without_dry_friction()` (here and to `equilibrium`) where tanh friction would count as damping. A
    command that is late passes a Padé approximation of order PADE, an all-pass 1 degree off at w d = 4.5, whose states
    follow the plant's; `discretise` is exact. Raises InputError for a name that is no input or output.
    """
    import control

    matrices, names = jacobians(plant, about, inputs, outputs, p), [state.name for state in plant.states]
    delay = plant.lateness(p)
    if delay > 0 and "command" in inputs:
        matrices = _behind(matrices, inputs.index("command"), delay)
        names += [f"late {i + 1}" for i in range(PADE)]
    return control.StateSpace(
        *matrices,
        inputs=list(inputs),
        outputs=list(outputs),
        states=names,
        name=f"{plant.name} linear".replace(".", "_"),
    )


def jacobians(
    plant: Plant, about: Equilibrium, inputs: tuple[str, ...], outputs: tuple[str, ...], p: np.ndarray | None
) -> Matrices:
    """A, B, C, D of the plant from what it holds, as `linearise` without the delay of the command."""
    columns = [_index(name, [i.name for i in plant.inputs]) for name in inputs]
    rows = [_index(name, list(plant.outputs)) for name in outputs]
    parts = plant.slopes(about.x, about.u, plant.p if p is None else p)
    a, b, c, d = (np.array(part.full()) for part in parts)
    return a, b[:, columns], c[rows], d[np.ix_(rows, columns)]


def _behind(matrices: Matrices, column: int, delay: float) -> Matrices:
    """The same with one input behind a Padé approximation of `delay` [s]."""
    (a, b, c, d), (late, enter, leave, direct) = matrices, _late_by_one()
    before, straight = b[:, [column]], d[:, [column]]
    b, d, entering = b.copy(), d.copy(), np.zeros((PADE, b.shape[1]))
    b[:, [column]], d[:, [column]], entering[:, [column]] = before * direct, straight * direct, enter / delay
    whole = np.block([[a, before @ leave], [np.zeros((PADE, len(a))), late / delay]])
    return whole, np.vstack((b, entering)), np.hstack((c, straight @ leave)), d


@cache
def _late_by_one() -> Matrices:
    """A Padé approximation of a delay of 1 s."""
    import control
    from scipy.signal import tf2ss

    return tf2ss(*control.pade(1, PADE))


def _index(name: str, known: list[str]) -> int:
    if name not in known:
        raise InputError(f'no signal "{name}" there; {nearest(name, known)}')
    return known.index(name)
