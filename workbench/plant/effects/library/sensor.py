"""sensor.lag: the pressure transducers sit at the end of lines and answer late."""

from functools import partial

import casadi as ca

from ..decorator import effect, number, state
from ..effect import Scope
from ..lag import first_order, second_order

_DOEBELIN = "Doebelin, Measurement Systems, 5th ed., McGraw-Hill 2004, ch. 6: transducer and tubing"
_A, _B = state("a", "Pa", 1e7, follows="P1"), state("b", "Pa", 1e7, follows="P2")
_A_RATE, _B_RATE = state("a_rate", "Pa", 1e7), state("b_rate", "Pa", 1e7)

_lag = partial(
    effect,
    "sensor.lag",
    equation="sensor",
    slot="sensor_pa",
    shows="fast multisine and steps on the command, with both pressures and acceleration or spool recorded",
)


def _lag_b(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau y' = pB - y."""
    return first_order(pressure, s, "b")


@_lag(
    "first order",
    also={"sensor_pb": _lag_b},
    source=f"{_DOEBELIN}, heavily damped",
    numbers=(number("tau", 2e-3, "s", shown="ms", low=0.0, high=0.1, off=0.0, meaning="time constant"),),
    states=(_A, _B),
)
def first_order_lag(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau y' = pA - y, and so for pB."""
    return first_order(pressure, s, "a")


def _line_b(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau^2 y'' + 2 zeta tau y' + y = pB."""
    return second_order(pressure, s, "b")


@_lag(
    "line",
    also={"sensor_pb": _line_b},
    source=f"{_DOEBELIN}, slightly damped",
    numbers=(
        number("tau", 2e-3, "s", shown="ms", low=0.0, high=0.05, off=0.0, meaning="period of the resonance over 2 pi"),
        number("zeta", 0.3, "1", low=0.05, high=1.5, meaning="its damping ratio"),
    ),
    states=(_A, _A_RATE, _B, _B_RATE),
)
def line(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau^2 y'' + 2 zeta tau y' + y = pA, and so for pB."""
    return second_order(pressure, s, "a")
