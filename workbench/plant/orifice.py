"""Orifice, lap and stop laws that every stage shares, regularised so that their derivatives exist."""

import casadi as ca

_QUIET = 1e6  # Pa^2: below 1 kPa a turbulent orifice turns linear
_CURTAIN = 0.2e-6  # m: the nozzle curtain closes over this length


def root(drop: ca.SX) -> ca.SX:
    """Signed root of a pressure drop [Pa]: d / (d^2 + 1e6)^(1/4) [Pa^0.5] (paper, eq. 1, with its missing sign)."""
    return drop / ca.sqrt(ca.sqrt(drop * drop + _QUIET))


def exponential_lap(z: ca.SX, eps: ca.SX) -> ca.SX:
    """Opening [m] of a land at spool travel z [m]: z + eps above null, eps exp(z/eps) below; C1 (paper, lap model)."""
    return ca.if_else(z >= 0, z + eps, eps * ca.exp(ca.fmin(z, 0) / eps))


def curtain(gap: ca.SX) -> ca.SX:
    """The positive part of a nozzle gap [m], rounded over 0.2 um."""
    return 0.5 * (gap + ca.sqrt(gap * gap + _CURTAIN * _CURTAIN))


def volume(dead: ca.SX, swept: ca.SX) -> ca.SX:
    """A chamber volume [m^3], never below 5 % of its dead volume: an overrun stop must not empty it."""
    return ca.fmax(dead + swept, 0.05 * dead)


def spool_stop(z: ca.SX, v: ca.SX, travel: ca.SX, stiffness: ca.SX, mass: ca.SX) -> ca.SX:
    """Force [N] of a stop at +-travel [m] on a spool: stiff, damped at 0.7 of critical, never pulling."""
    damping = 1.4 * ca.sqrt(stiffness * mass)
    return end_stop(z, v, travel, stiffness, damping, 0.01 * travel)


def end_stop(x: ca.SX, v: ca.SX, travel: ca.SX, stiffness: ca.SX, damping: ca.SX, depth: ca.SX | float) -> ca.SX:
    """Force [N] of stops at +-travel [m]; the damping grows in over `depth` [m] so that it starts without a jump."""

    def push(over: ca.SX, speed: ca.SX) -> ca.SX:
        into = ca.fmax(over, 0)
        return ca.fmax(stiffness * into + damping * speed * into / (into + depth), 0)

    return push(x - travel, v) - push(-x - travel, -v)


def land_flows(
    openings: tuple[ca.SX, ca.SX], gradient: ca.SX, ports: tuple[ca.SX, ca.SX], supply: ca.SX, drain: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """Flow into port A and out of port B [m^3/s] of a four-way spool with openings o(z), o(-z) [m]."""
    forward, backward = openings
    a, b = ports
    into_a = gradient * (forward * root(supply - a) - backward * root(a - drain))
    out_of_b = gradient * (forward * root(b - drain) - backward * root(supply - b))
    return into_a, out_of_b


def flow_force(
    openings: tuple[ca.SX, ca.SX], coefficient: ca.SX, ports: tuple[ca.SX, ca.SX], supply: ca.SX, drain: ca.SX
) -> ca.SX:
    """Steady flow force [N] closing a four-way spool (paper, eq. 3, with its missing area)."""
    forward, backward = openings
    a, b = ports
    return coefficient * (
        forward * (ca.fabs(supply - a) + ca.fabs(b - drain)) - backward * (ca.fabs(supply - b) + ca.fabs(a - drain))
    )
