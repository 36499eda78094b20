"""Fixed steps with their exact forward tangents, as graphs of the same form as an adaptive attempt.

An adaptive run is not a smooth function of its parameters; one of fixed steps is. Its tangent along a direction
(dx0, dp) of the initial state and the parameters is carried along as further states, so that the lanes of a batch are
directions and the same back ends run it.
"""

import casadi as ca

from ..plant import Plant
from .rosenbrock import step

_ROUND = 1e-9  # of a step: what is left of an interval below this is nothing


def fixed_attempt(plant: Plant) -> ca.Function:
    """(s, u, [p, dp], longest) -> s with s = [x, dx, time left, step, attempts]: one step of an interval.

    The interval is divided into the fewest equal steps that are not longer than `longest` [s].
    """
    n, k = plant.n, len(plant.parameters)
    x, dx, u = ca.SX.sym("x", n), ca.SX.sym("dx", n), ca.SX.sym("u", len(plant.inputs))
    p, dp, longest = ca.SX.sym("p", k), ca.SX.sym("dp", k), ca.SX.sym("longest")
    left, before, attempts = ca.SX.sym("left"), ca.SX.sym("step"), ca.SX.sym("attempts")
    active = left > 0
    count = ca.fmax(ca.ceil(left / longest - _ROUND), 1)
    length = ca.if_else(active, left / count, longest)
    after = step(plant, x, u, p, length).state
    moved = ca.jtimes(after, ca.vertcat(x, p), ca.vertcat(dx, dp))
    result = ca.vertcat(
        ca.if_else(active, after, x),
        ca.if_else(active, moved, dx),
        ca.if_else(active, ca.if_else(count > 1, left - length, 0), left),  # an idle lane stays as it is
        ca.if_else(active, length, before),
        attempts + active,
    )
    state = ca.vertcat(x, dx, left, before, attempts)
    return ca.Function("attempt", [state, u, ca.vertcat(p, dp), longest], [ca.cse(result)])


def tangent_outputs(plant: Plant) -> ca.Function:
    """([x, dx], u, [p, dp]) -> [y, dy]: the outputs and their change along the direction."""
    n, k = plant.n, len(plant.parameters)
    x, dx, u = ca.SX.sym("x", n), ca.SX.sym("dx", n), ca.SX.sym("u", len(plant.inputs))
    p, dp = ca.SX.sym("p", k), ca.SX.sym("dp", k)
    y = plant.h(x, u, p)
    dy = ca.jtimes(y, ca.vertcat(x, p), ca.vertcat(dx, dp))
    return ca.Function("h", [ca.vertcat(x, dx), u, ca.vertcat(p, dp)], [ca.cse(ca.vertcat(y, dy))])
