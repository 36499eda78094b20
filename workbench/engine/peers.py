"""The public solvers that this engine is measured against, on the same plant with inputs held over intervals.

Each takes (plant, x0 [n], t [k + 1], u [k, m], tolerance) and returns states [k + 1, n]. Each is started anew in every
interval, as a loop that writes a command every period demands.
"""

from collections.abc import Callable

import casadi as ca
import numpy as np
from scipy.integrate import ode, solve_ivp

from ..plant import Plant
from .buffered import BufferedFunction

Peer = Callable[[Plant, np.ndarray, np.ndarray, np.ndarray, float], np.ndarray]


def radau(plant: Plant, x0: np.ndarray, t: np.ndarray, u: np.ndarray, tolerance: float) -> np.ndarray:
    """scipy's Radau IIA of order 5 with CasADi's rates and exact Jacobian."""
    rates, slopes = _rates(plant)
    states = [x0]
    for j in range(len(t) - 1):
        inputs = u[j]
        solution = solve_ivp(
            lambda _t, x, inputs=inputs: rates(x, inputs),
            (t[j], t[j + 1]),
            states[-1],
            "Radau",
            jac=lambda _t, x, inputs=inputs: slopes(x, inputs),
            rtol=tolerance,
            atol=tolerance * plant.scale,
        )
        states.append(solution.y[:, -1])
    return np.array(states)


def lsoda(plant: Plant, x0: np.ndarray, t: np.ndarray, u: np.ndarray, tolerance: float) -> np.ndarray:
    """scipy's LSODA with CasADi's rates and exact Jacobian, called without a copy."""
    rates, slopes = _rates(plant)
    inputs = [u[0]]
    solver = ode(lambda _t, x: rates(x, inputs[0]), lambda _t, x: slopes(x, inputs[0]))
    solver.set_integrator("lsoda", rtol=tolerance, atol=tolerance * plant.scale, with_jacobian=True, nsteps=10_000)
    states = [x0]
    for j in range(len(t) - 1):
        inputs[0] = u[j]
        solver.set_initial_value(states[-1], t[j])
        states.append(np.array(solver.integrate(t[j + 1])))
    return np.array(states)


def cvodes(plant: Plant, x0: np.ndarray, t: np.ndarray, u: np.ndarray, tolerance: float) -> np.ndarray:
    """SUNDIALS' CVODES through CasADi, in scaled states as its absolute tolerance is one number; equal intervals."""
    z, inputs = ca.SX.sym("z", plant.n), ca.SX.sym("u", len(plant.inputs))
    rates = plant.f(z * plant.scale, inputs, plant.p) / plant.scale
    options = {"abstol": tolerance, "reltol": tolerance, "max_num_steps": 100_000}
    solver = ca.integrator("cvodes", "cvodes", {"x": z, "p": inputs, "ode": rates}, 0.0, float(t[1] - t[0]), options)
    states = [x0 / plant.scale]
    for j in range(len(t) - 1):
        states.append(np.array(solver(x0=states[-1], p=u[j])["xf"]).ravel())
    return np.array(states) * plant.scale


PEERS: dict[str, Peer] = {"scipy Radau": radau, "scipy LSODA compiled": lsoda, "CasADi CVODES": cvodes}


def _rates(plant: Plant) -> tuple[Callable[..., np.ndarray], Callable[..., np.ndarray]]:
    """Rates [n] and their Jacobian [n, n] as functions of state and input, through buffers."""
    x, u = ca.SX.sym("x", plant.n), ca.SX.sym("u", len(plant.inputs))
    expression = plant.f(x, u, ca.DM(plant.p))
    rates = ca.Function("rates", [x, u], [expression])
    slopes = ca.Function("slopes", [x, u], [ca.densify(ca.jacobian(expression, x))])
    return _buffered(rates, (plant.n,)), _buffered(slopes, (plant.n, plant.n))


def _buffered(function: ca.Function, shape: tuple[int, ...]) -> Callable[..., np.ndarray]:
    buffered = BufferedFunction(function)

    def evaluate(state: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        buffered.given[0][:], buffered.given[1][:] = state, inputs
        buffered.evaluate()
        return buffered.found.reshape(shape, order="F").copy()

    return evaluate
