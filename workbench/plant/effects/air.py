"""oil.air: entrained air makes the oil softer, most of all at low pressure. Effective bulk modulus K [Pa]."""

import casadi as ca

from .effect import Effect, EffectNumber, Scope

_ATMOSPHERE = 1.013e5  # Pa: where the share of air is stated
_LOWEST = 2e4  # Pa: below this the gas is taken as it is here; the oil cavitates and the model is invalid
_ADIABATIC = 1.4


def _gas_pressure(s: Scope) -> ca.SX:
    return ca.fmax(s["pressure"], _LOWEST)


def _isothermal(modulus: ca.SX, s: Scope) -> ca.SX:
    """K = beta/[1 + alpha (p0/p)(beta/p - 1)], p0 = 1 atm."""
    p = _gas_pressure(s)
    return modulus / (1 + s.p("alpha") * _ATMOSPHERE / p * (modulus / p - 1))


def _polytropic(modulus: ca.SX, s: Scope) -> ca.SX:
    """K = [alpha r + 1 - alpha]/[alpha r/(n p) + (1 - alpha)/beta], r = (p0/p)^(1/n), n = 1.4, p0 = 1 atm."""
    p, alpha = _gas_pressure(s), s.p("alpha")
    gas = alpha * (_ATMOSPHERE / p) ** (1 / _ADIABATIC)
    return modulus * (gas + 1 - alpha) / (gas * modulus / (_ADIABATIC * p) + 1 - alpha)


def _fixed_share(modulus: ca.SX, s: Scope) -> ca.SX:
    """1/K = 1/beta + x/(1.4 p): a share x of the volume is air at every pressure."""
    return modulus / (1 + s.p("x") * modulus / (_ADIABATIC * _gas_pressure(s)))


_SHOWS = "moves that brake hard, so that a chamber's pressure falls, with both pressures recorded"
_ALPHA = EffectNumber("alpha", "1", "%", 0.03, 0.0, 0.3, "share of air in the volume at 1 atm", off=0.0)


def _effect(formula: str, source: str, number: EffectNumber) -> Effect:
    law = {"isothermal": _isothermal, "polytropic": _polytropic, "fixed share": _fixed_share}[formula]
    return Effect("oil.air", formula, "flow", source, _SHOWS, {"modulus": law}, (number,))


EFFECTS = (
    _effect("isothermal", "Wylie, Streeter, Fluid Transients in Systems, Prentice Hall 1993, sec. 1.3", _ALPHA),
    _effect("polytropic", "Nykanen, Esque, Ellman, Bath Workshop PTMC 2000: comparison of fluid models", _ALPHA),
    _effect(
        "fixed share",
        "Merritt, Hydraulic Control Systems, Wiley 1967, sec. 1.4",
        EffectNumber("x", "1", "%", 3e-3, 0.0, 0.1, "share of air in the volume", off=0.0),
    ),
)
