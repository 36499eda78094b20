"""A law of an effect, evaluated for numbers, for the tests of the library."""

import casadi as ca
import numpy as np

from workbench.plant.effects import Scope

EPS, TRAVEL, BETA = 3.7e-6, 2.29e-3, 1e9


def evaluated(effect, slot, value, p=None, x=None, **context):
    """What a law returns for numbers, and the rates that it sets; numbers that are not given are typical."""
    p = {number.name: number.typical for number in effect.numbers} | (p or {})
    x = {state.name: 0.0 for state in effect.states} | (x or {})
    rates = {}
    keyed = [{effect.key(name): ca.SX(v) for name, v in values.items()} for values in (p, x)]
    scope = Scope(effect, *keyed, {}, rates, {name: ca.SX(v) for name, v in context.items()})
    result = effect.laws[slot](tuple(map(ca.SX, value)) if isinstance(value, tuple) else value, scope)
    parts = () if result is None else result if isinstance(result, tuple) else (result,)
    number = [float(ca.evalf(ca.SX(part))) for part in parts]
    return number, {name.removeprefix(f"{effect.name}."): float(ca.evalf(rate)) for name, rate in rates.items()}


def lap(z):
    """The plant's own lap [m]."""
    return z + EPS if z >= 0 else EPS * np.exp(z / EPS)
