"""Adaptive steps with their exact forward tangents, as graphs of the same form as a plain attempt.

The tangent along a direction (dx0, du, dp) of initial state, inputs and parameters is carried along as further states,
so that the lanes of a batch are directions and the same back ends run it. It is exact for the steps that are taken: how
their lengths would change is left out, an effect of the size of the tolerance.
"""

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca

from ..plant import Plant
from ..plant.assembly import Variable
from .rosenbrock import attempt


def paced(plant: Plant) -> Plant:
    """The plant with a further input, by how much faster its time goes [1], if its command is late; else the plant.

    A tangent along it in a part of an interval is that to the part's length, so that the tangent to the moment at which
    a late command arrives is exact: the part before it is longer, the part behind it shorter.
    """
    if plant.delay is None or plant.interpolated:
        return plant
    x, u, p = (ca.SX.sym(name, plant.f.numel_in(place)) for place, name in enumerate("xup"))
    pace = ca.SX.sym("pace")
    f, h = plant.f(x, u, p) * (1 + pace), plant.h(x, u, p)
    f, h = (ca.Function(name, [x, ca.vertcat(u, pace), p], [graph]) for name, graph in (("f", f), ("h", h)))
    return replace(plant, f=f, h=h, inputs=(*plant.inputs, Variable("pace", "1", 1.0)))


def tangent_attempt(plant: Plant) -> ca.Function:
    """(s, [u, du], [p, dp], tolerance) -> s, s = [x, dx, time left, step, attempts]: an accepted or rejected step."""
    (x, dx), (u, du), (p, dp) = _pairs(plant)
    clock, tolerance = ca.SX.sym("clock", 3), ca.SX.sym("tolerance")
    tried = attempt(plant, x, u, p, clock, tolerance)
    moved = ca.jtimes(tried.state, ca.vertcat(x, u, p), ca.vertcat(dx, du, dp))
    after = ca.vertcat(ca.if_else(tried.fine, tried.state, x), ca.if_else(tried.fine, moved, dx), tried.clock)
    state = ca.vertcat(x, dx, clock)
    return ca.Function("attempt", [state, ca.vertcat(u, du), ca.vertcat(p, dp), tolerance], [ca.cse(after)])


def tangent_outputs(plant: Plant, names: Sequence[str]) -> ca.Function:
    """([x, dx], [u, du], [p, dp]) -> dy: the change of the outputs `names` along the direction."""
    (x, dx), (u, du), (p, dp) = _pairs(plant)
    y = plant.h(x, u, p)[[plant.output(name) for name in names]]
    dy = ca.jtimes(y, ca.vertcat(x, u, p), ca.vertcat(dx, du, dp))
    return ca.Function("h", [ca.vertcat(x, dx), ca.vertcat(u, du), ca.vertcat(p, dp)], [ca.cse(dy)])


def _pairs(plant: Plant) -> list[tuple[ca.SX, ca.SX]]:
    sizes = {"x": plant.n, "u": len(plant.inputs), "p": len(plant.parameters)}
    return [(ca.SX.sym(name, size), ca.SX.sym(f"d{name}", size)) for name, size in sizes.items()]
