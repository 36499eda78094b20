"""The graph of a linear plant: its numbers stay parameters, so that plants of a set run in lanes."""

from dataclasses import replace

import casadi as ca

from ..rigs.linear_rig import LinearRig
from .assembly import Assembly, Plant


def build_linear(rig: LinearRig) -> Plant:
    """Command and, where one acts, disturbance in; the model's outputs out. The delay of the command is exact."""
    numbers = {name: number.value for name, number in rig.numbers.items()} | rig.constants
    b = Assembly(rig.name, numbers | {"computing": rig.computing})
    command = b.input("command", "1", 1.0)
    force = b.input("disturbance", "N", 1e3) if rig.takes_load else ca.SX(0)
    x = ca.vertcat(*(b.state(f"x{i + 1}", "1", scale) for i, scale in enumerate(rig.sizes)))
    a, enters, c, e = (_matrix(part) for part in rig.matrices({name: b[name] for name in numbers}))
    rates = a @ x + enters * command - e * force
    for i in range(rig.form.order):
        b.rate(f"x{i + 1}", rates[i])
    outputs = c @ x
    b.output(**{name: outputs[i] for i, name in enumerate(rig.form.outputs)})
    plant = b.finish()
    return replace(plant, delay="delay", computing="computing")


def _matrix(rows: list[list[ca.SX]]) -> ca.SX:
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))
