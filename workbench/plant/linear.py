"""The graph of a linear plant: its numbers stay parameters, so that plants of a set run in lanes."""

from dataclasses import replace

import casadi as ca
import numpy as np

from ..rigs.linear_rig import LinearRig
from .assembly import Assembly, Plant

_SWEPT = np.geomspace(1e-3, 1e5, 400)  # rad/s: where the states' magnitudes are looked for


def build_linear(rig: LinearRig) -> Plant:
    """Command and, where one acts, disturbance in; the model's outputs out. The delay of the command is exact."""
    numbers = {name: number.value for name, number in rig.numbers.items()} | rig.constants
    b = Assembly(rig.name, numbers | {"delay": rig.delay.value})
    command = b.input("command", "1", 1.0)
    force = b.input("disturbance", "N", 1e3) if rig.takes_load else ca.SX(0)
    x = ca.vertcat(*(b.state(f"x{i + 1}", "1", scale) for i, scale in enumerate(magnitudes(rig))))
    a, enters, c, e = (_matrix(part) for part in rig.matrices({name: b[name] for name in numbers}))
    rates = a @ x + enters * command - e * force
    for i in range(rig.form.order):
        b.rate(f"x{i + 1}", rates[i])
    outputs = c @ x
    b.output(**{name: outputs[i] for i, name in enumerate(rig.form.outputs)})
    plant = b.finish()
    return replace(plant, delay="delay")


def magnitudes(rig: LinearRig) -> list[float]:
    """Sizes of the states: the largest over sines of a command of up to 1 that keep the position in the stroke."""
    a, b, c, _ = rig.state_matrices()
    resolvent = 1j * _SWEPT[:, None, None] * np.eye(len(a)) - a
    states = np.linalg.solve(resolvent, np.broadcast_to(b, (len(_SWEPT), *b.shape)))[..., 0]
    travel = np.maximum(np.abs(states @ c[0]), np.finfo(float).tiny)
    sizes = (np.abs(states) * np.minimum(1.0, rig.limit("stroke") / travel)[:, None]).max(axis=0)
    return np.where(sizes > 0, sizes, 1.0).tolist()


def _matrix(rows: list[list[ca.SX]]) -> ca.SX:
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))
