"""Linear models of a plant about an operating point, as python-control systems."""

from functools import cache
from math import comb, factorial
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import InputError, nearest
from .interconnect import select, series
from .operating_point import Equilibrium
from .state_space import Matrices, StateSpace, transfer_function

if TYPE_CHECKING:
    import control

    from ..plant import Plant

PADE = 4  # order of the approximation of a delay d: 1 degree off at w d = 4.5 rad


def linearise(
    plant: "Plant",
    about: Equilibrium,
    inputs: tuple[str, ...] = ("command",),
    outputs: tuple[str, ...] = ("position",),
    p: np.ndarray | None = None,
) -> "control.StateSpace":
    """x' = A x + B u, y = C x + D u about an operating point, in SI.

    A command that is late passes a Padé approximation of order PADE, an all-pass 1 degree off at w d = 4.5, whose
    states follow the plant's; `discretise` is exact.

    Parameters
    ----------
    plant
        A Plant, or a Rig, whose plant is built.
    about
        The operating point.
    inputs
        Names of u.
    outputs
        Names of the signals of y.
    p
        Parameters [k] other than the plant's: `plant.without_dry_friction()`, here and to `equilibrium`, where tanh
        friction would count as damping.

    Returns
    -------
    A python-control system with named inputs, outputs and states.

    Raises
    ------
    InputError
        For a name that is no input or output.
    """
    model = linear_plant(plant, about, inputs, outputs, p)
    late = [f"late {i + 1}" for i in range(len(model.A) - plant.n)]
    states = [state.name for state in plant.states]
    return model.to_control(states=states + late, name=f"{plant.name} linear".replace(".", "_"))


def linear_plant(
    plant: "Plant",
    about: Equilibrium,
    inputs: tuple[str, ...] = ("command",),
    outputs: tuple[str, ...] = ("position",),
    p: np.ndarray | None = None,
) -> StateSpace:
    """What `linearise` gives, as the workbench's own linear system."""
    model = StateSpace(*jacobians(plant, about, inputs, outputs, p), 0.0, list(inputs), list(outputs))
    delay = plant.lateness(p)
    if not (delay > 0 and "command" in inputs):
        return model
    a, b, c, d = _late_by_one()
    late = StateSpace(a / delay, b / delay, c, d, 0.0, ["command"], ["command"])
    return select(series(late, model), inputs, outputs)


def jacobians(
    plant: "Plant", about: Equilibrium, inputs: tuple[str, ...], outputs: tuple[str, ...], p: np.ndarray | None
) -> Matrices:
    """A, B, C, D of the plant from what it holds, as `linearise` without the delay of the command."""
    columns = [_index(name, [i.name for i in plant.inputs]) for name in inputs]
    rows = [_index(name, list(plant.outputs)) for name in outputs]
    parts = plant.slopes(about.x, about.u, plant.p if p is None else p)
    a, b, c, d = (np.array(part.full()) for part in parts)
    return a, b[:, columns], c[rows], d[np.ix_(rows, columns)]


@cache
def _late_by_one() -> Matrices:
    """A Padé approximation of a delay of 1 s."""
    order = range(PADE, -1, -1)
    top = factorial(2 * PADE) // factorial(PADE)
    powers = [comb(PADE, k) * factorial(2 * PADE - k) / (factorial(PADE) * top) for k in order]
    return transfer_function([share * (-1) ** k for share, k in zip(powers, order, strict=True)], powers)


def _index(name: str, known: list[str]) -> int:
    if name not in known:
        raise InputError(f'no signal "{name}" there; {nearest(name, known)}')
    return known.index(name)
