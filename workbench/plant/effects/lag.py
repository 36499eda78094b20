"""Lags that vanish exactly: at a time constant of 0 the pole meets a zero, 10 us fast, and nothing divides by 0."""

import casadi as ca

from .effect import Scope

FAST = 1e-5  # s: no slower than the fastest oil of a valve, so an integrator hardly notices


def first_order(value: ca.SX, s: Scope, state: str, prefix: str = "") -> ca.SX:
    """(1 + T0 d/dt) value = (1 + (tau + T0) d/dt) y with T0 = 10 us: y lags by tau exactly, and is value at tau = 0.

    `state` [unit of value] is the slow part of y; `prefix`tau [s] a number of the effect.
    """
    slow, length = s.x(state), s.p(f"{prefix}tau") + FAST
    s.rate(state, (value - slow) / length)
    return slow + FAST / length * (value - slow)


def second_order(value: ca.SX, s: Scope, state: str, prefix: str = "") -> ca.SX:
    """T^2 y'' + 2 zeta T y' + y = value, T = tau + 10 us, read out so that it is exactly value at tau = 0.

    States `state` (y) and `state`_rate (T y') [unit of value]; `prefix`tau [s] and `prefix`zeta [1] are numbers of the
    effect.
    """
    return section(value, s, state, s.p(f"{prefix}tau"), s.p(f"{prefix}zeta"))


def section(value: ca.SX, s: Scope, state: str, tau: ca.SX, zeta: ca.SX | float) -> ca.SX:
    """`second_order` with a time tau [s] and a damping ratio zeta that are expressions."""
    y, w = s.x(state), s.x(f"{state}_rate")
    length = tau + FAST
    bend = value - y - 2 * zeta * w  # T^2 y''
    s.rate(state, w / length)
    s.rate(f"{state}_rate", bend / length)
    share = FAST / length
    return y + 2 * zeta * share * w + share * share * bend
