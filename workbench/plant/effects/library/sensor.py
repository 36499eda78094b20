"""What measures: transducers at the end of lines (sensor.lag) or with a curve (sensor.bend), a logger's low pass
(sensor.filter).
"""

from functools import partial

import casadi as ca

from ....base.signals import SIGNALS
from ..decorator import Law, effect, number, state
from ..effect import Effect, EffectNumber, Scope
from ..lag import first_order, second_order, section
from ..natural import LARGE
from ..slots import READS, SENSED

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


_SECTIONS = {  # of each filter with -3 dB at 1: natural frequency and damping ratio of its sections
    "bessel 2": ((1.2720196495, 0.8660254038),),
    "butterworth 2": ((1.0, 0.7071067812),),
    "bessel 4": ((1.4301715600, 0.9579744619), (1.6033575162, 0.6207029650)),
    "butterworth 4": ((1.0, 0.9238795325), (1.0, 0.3826834324)),
}


def _logger_filter(formula: str) -> Effect:
    """A low pass common to all measured channels."""
    sections = _SECTIONS[formula]

    def behind(name: str) -> Law:
        def filtered(signal: ca.SX, s: Scope) -> ca.SX:
            """y = signal/prod_k[(tau s/r_k)^2 + 2 zeta_k tau s/r_k + 1], r_k and zeta_k those of the filter's name."""
            moves = signal - s["rest"]
            for k, (ratio, zeta) in enumerate(sections):
                moves = section(moves, s, f"{name}{k}", s.p("tau") / ratio, zeta)
            return s["rest"] + moves

        return filtered

    first, *others = SENSED
    return effect(
        "sensor.filter",
        formula,
        equation="sensor",
        family="drive timing",
        slot=f"sensor_{first}",
        also={f"sensor_{name}": behind(name) for name in others},
        source="Tietze, Schenk, Electronic Circuits, 2nd ed. 2008, ch. 13: active filters, table of sections",
        shows="the command looped back into the logger, beside the command as it was sent",
        numbers=(number("tau", 1e-3, "s", shown="ms", low=0.0, high=0.05, off=0.0, meaning="1/(2 pi f), f the -3 dB"),),
        states=tuple(
            state(
                f"{name}{k}{rate}",
                SIGNALS[name].si,
                LARGE.get(name, 1.0),
                follows="" if rate else READS.get(name, ""),
                of=f"sensor_{name}",
            )
            for name in SENSED
            for k in range(len(sections))
            for rate in ("", "_rate")
        ),
        alike="drive timing",
    )(behind(first))


bessel_2, butterworth_2, bessel_4, butterworth_4 = map(_logger_filter, _SECTIONS)


_bend = partial(
    effect,
    "sensor.bend",
    equation="sensor",
    source="Doebelin, Measurement Systems, 5th ed., McGraw-Hill 2004, ch. 3: static calibration, terminal-based line",
)


def _share(name: str = "e", of: str = "") -> EffectNumber:
    return number(
        name, 0.01, "1", shown="%", low=-0.1, high=0.1, off=0.0, meaning=f"bend{of} in the middle of the range"
    )


def _bent(signal: ca.SX, low: ca.SX, high: ca.SX, share: ca.SX) -> ca.SX:
    """y = s + e (high - low) 4 w (1 - w), w = sat01((s - low)/(high - low))."""
    w = ca.fmax(ca.fmin((signal - low) / (high - low), 1), 0)
    return signal + share * (high - low) * 4 * w * (1 - w)


@_bend(
    "position", slot="sensor_position", shows="slow travel from stop to stop, with the load cell", numbers=(_share(),)
)
def bent_position(position: ca.SX, s: Scope) -> ca.SX:
    """x + e S 4 w (1 - w), w from 0 at one stop to 1 at the other."""
    return _bent(position, s["low"], s["high"], s.p("e"))


@_bend("force", slot="sensor_force", shows="forces of all sizes beside both pressures", numbers=(_share(),))
def bent_force(force: ca.SX, s: Scope) -> ca.SX:
    """F + e Fm 4 w (1 - w) sign F, w = sat01(|F|/Fm), Fm supply pressure times the area of side A: right at no load."""
    bent = _bent(ca.fabs(force), ca.SX(0), s["high"], s.p("e"))
    return ca.if_else(force < 0, -bent, bent)


def _bent_b(pressure: ca.SX, s: Scope) -> ca.SX:
    """pB + b Ps 4 w (1 - w), w = sat01(pB/Ps)."""
    return _bent(pressure, s["low"], s["high"], s.p("b"))


@_bend(
    "pressures",
    slot="sensor_pa",
    also={"sensor_pb": _bent_b},
    shows="pressures from the low side to the supply, beside a second gauge or a load cell",
    numbers=(_share("a", " of A"), _share("b", " of B")),
)
def bent_pressures(pressure: ca.SX, s: Scope) -> ca.SX:
    """pA + a Ps 4 w (1 - w), w = sat01(pA/Ps)."""
    return _bent(pressure, s["low"], s["high"], s.p("a"))
