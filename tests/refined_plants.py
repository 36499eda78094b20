"""Plants with and without a refinement or a learned piece, for their tests."""

import casadi as ca
import numpy as np

from workbench.plant import build


def differences(rig, effect, plain=(), seed=0):
    """Largest relative differences of rates and outputs from a plant with `plain`, with the effect off and typical."""
    random = np.random.default_rng(seed)
    base, plant = build(rig, also=plain), build(rig, also=(effect,))
    u = 0.1 * random.standard_normal(len(plant.inputs))
    own = [plant.state(state.name) for state in base.states]
    x = plant.start + 0.1 * plant.scale * random.standard_normal(plant.n)
    plain_numbers = {n.name for each in plain for n in each.numbers}
    off = {effect.key(n.name): n.off for n in effect.numbers if n.name not in plain_numbers and n.off is not None}
    p = plant.parameter_values(**off)

    def far(values):
        return max(
            _apart(np.array(plant.f(x, u, values)).ravel()[own], np.array(base.f(x[own], u, base.p)).ravel()),
            _apart(np.array(plant.h(x, u, values)).ravel(), np.array(base.h(x[own], u, base.p)).ravel()),
        )

    return far(p), far(plant.p)


def _apart(values, expected):
    return np.max(np.abs(values - expected) / (np.abs(expected) + 1e-9))


def graph_of(plant):
    """Rates and outputs with their slopes to states and parameters, as one function."""
    x, u, p = (ca.SX.sym(name, n) for name, n in zip("xup", (plant.n, len(plant.inputs), len(plant.p)), strict=True))
    both = ca.vertcat(plant.f(x, u, p), plant.h(x, u, p))
    return ca.Function("both", [x, u, p], [both, ca.jacobian(both, x), ca.jacobian(both, p)])
