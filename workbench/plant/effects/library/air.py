"""oil.air: entrained air makes the oil softer, most of all at low pressure. Effective bulk modulus K [Pa]."""

from functools import partial

import casadi as ca

from ....rigs.oil import ATMOSPHERE
from ..decorator import effect, number
from ..effect import Scope

_LOWEST = 2e4  # Pa: below this the air is taken as it is here; gas that comes out of the oil rules there (plant/oil.py)
_ADIABATIC = 1.4
_REFERENCE = 1e7  # Pa: where compliances of oil and air are compared

_ALPHA = number(
    "alpha", 0.03, "1", shown="%", low=0.0, high=0.3, off=0.0, meaning="share of air in the volume at 1 atm"
)
_air = partial(
    effect,
    "oil.air",
    equation="flow",
    slot="modulus",
    shows="moves that brake hard, so that a chamber's pressure falls, with both pressures recorded",
)


def _gas_pressure(s: Scope) -> ca.SX:
    return ca.fmax(s["pressure"], _LOWEST)


@_air("isothermal", source="Wylie, Streeter, Fluid Transients in Systems, 1993: gas in a liquid", numbers=(_ALPHA,))
def isothermal(modulus: ca.SX, s: Scope) -> ca.SX:
    """K = beta/[1 + alpha (p0/p)(beta/p - 1)], p0 = 1 atm."""
    p = _gas_pressure(s)
    return modulus / (1 + s.p("alpha") * ATMOSPHERE / p * (modulus / p - 1))


@_air(
    "polytropic",
    source="Nykanen, Esque, Ellman, Bath Workshop PTMC, 2000",
    numbers=(_ALPHA,),
)
def polytropic(modulus: ca.SX, s: Scope) -> ca.SX:
    """K = [alpha r + 1 - alpha]/[alpha r/(n p) + (1 - alpha)/beta], r = (p0/p)^(1/n), n = 1.4, p0 = 1 atm."""
    p, alpha = _gas_pressure(s), s.p("alpha")
    gas = alpha * (ATMOSPHERE / p) ** (1 / _ADIABATIC)
    return modulus * (gas + 1 - alpha) / (gas * modulus / (_ADIABATIC * p) + 1 - alpha)


@_air(
    "fixed share",
    source="Merritt, Hydraulic Control Systems, Wiley 1967, ch. 1: effective bulk modulus",
    numbers=(number("x", 1e-3, "1", shown="%", low=0.0, high=0.1, off=0.0, meaning="share of air in the volume"),),
)
def fixed_share(modulus: ca.SX, s: Scope) -> ca.SX:
    """1/K = 1/beta + x/(1.4 p): a share x of the volume is air at every pressure."""
    return modulus / (1 + s.p("x") * modulus / (_ADIABATIC * _gas_pressure(s)))


@_air(
    "power",
    source="between the others: m = 1 is a fixed share, m = 2 isothermal; Merritt, Wiley 1967, ch. 1",
    numbers=(
        number(
            "x", 0.01, "1", low=0.0, high=2.0, off=0.0, meaning="compliance of the air over that of the oil, at 100 bar"
        ),
        number("m", 1.5, "1", low=0.3, high=4.0, meaning="power of its fall with pressure"),
    ),
)
def power(modulus: ca.SX, s: Scope) -> ca.SX:
    """K = beta/[1 + x (p1/p)^m], p1 = 100 bar."""
    return modulus / (1 + s.p("x") * (_REFERENCE / _gas_pressure(s)) ** s.p("m"))
