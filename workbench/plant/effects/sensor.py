"""sensor.lag: the pressure transducers sit at the end of lines and answer late."""

import casadi as ca

from .effect import Effect, EffectNumber, EffectState, Scope
from .lag import first_order, second_order

_SHOWS = "fast multisine and steps on the command, with both pressures and acceleration or spool recorded"


def _lag_a(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau y' = pA - y."""
    return first_order(pressure, s, "a")


def _lag_b(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau y' = pB - y."""
    return first_order(pressure, s, "b")


def _line_a(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau^2 y'' + 2 zeta tau y' + y = pA."""
    return second_order(pressure, s, "a")


def _line_b(pressure: ca.SX, s: Scope) -> ca.SX:
    """tau^2 y'' + 2 zeta tau y' + y = pB."""
    return second_order(pressure, s, "b")


def _states(*names: str) -> tuple[EffectState, ...]:
    return tuple(EffectState(name, "Pa", 1e7, 0.0 if name.endswith("rate") else 1e7) for name in names)


EFFECTS = (
    Effect(
        "sensor.lag",
        "first order",
        "sensor",
        "Doebelin, Measurement Systems, 5th ed., McGraw-Hill 2004, sec. 6.6: transducer and tubing, heavily damped",
        _SHOWS,
        {"sensor_pa": _lag_a, "sensor_pb": _lag_b},
        (EffectNumber("tau", "s", "ms", 2e-3, 0.0, 0.1, "time constant", off=0.0),),
        _states("a", "b"),
    ),
    Effect(
        "sensor.lag",
        "line",
        "sensor",
        "Doebelin, Measurement Systems, 5th ed., McGraw-Hill 2004, sec. 6.6: transducer and tubing, slightly damped",
        _SHOWS,
        {"sensor_pa": _line_a, "sensor_pb": _line_b},
        (
            EffectNumber("tau", "s", "ms", 2e-3, 0.0, 0.05, "1/(2 pi) of the period of the line's resonance", off=0.0),
            EffectNumber("zeta", "1", "1", 0.3, 0.05, 1.5, "its damping ratio"),
        ),
        _states("a", "a_rate", "b", "b_rate"),
    ),
)
