"""Linear models of a plant about an operating point, as python-control systems."""

import casadi as ca
import control
import numpy as np

from ..errors import InputError, nearest
from ..plant import Plant
from .equilibrium import Equilibrium


def linearise(
    plant: Plant,
    about: Equilibrium,
    inputs: tuple[str, ...] = ("command",),
    outputs: tuple[str, ...] = ("position",),
    p: np.ndarray | None = None,
) -> control.StateSpace:
    """x' = A x + B u, y = C x + D u about an operating point, in SI, named inputs, outputs and states.

    Pass `p = plant.without_dry_friction()` (here and to `equilibrium`) where tanh friction would count as damping.
    """
    p = plant.p if p is None else p
    names = [i.name for i in plant.inputs]
    columns = [_index(name, names) for name in inputs]
    rows = [_index(name, list(plant.outputs)) for name in outputs]
    x, u = ca.SX.sym("x", plant.n), ca.SX.sym("u", len(names))
    rates, seen = plant.f(x, u, ca.DM(p)), plant.h(x, u, ca.DM(p))
    parts = ca.Function(
        "parts",
        [x, u],
        [ca.jacobian(rates, x), ca.jacobian(rates, u), ca.jacobian(seen, x), ca.jacobian(seen, u)],
    )
    a, b, c, d = (np.array(part.full()) for part in parts(about.x, about.u))
    return control.StateSpace(
        a,
        b[:, columns],
        c[rows],
        d[np.ix_(rows, columns)],
        inputs=list(inputs),
        outputs=list(outputs),
        states=[state.name for state in plant.states],
        name=f"{plant.name} linear".replace(".", "_"),
    )


def _index(name: str, known: list[str]) -> int:
    if name not in known:
        raise InputError(f'no signal "{name}" there; {nearest(name, known)}')
    return known.index(name)
