"""Effects of a pump drive: its pump, direction valves, hoses, accumulator and motor."""

from functools import partial

import casadi as ca

from ...orifice import root
from ..decorator import effect, number, state
from ..effect import Scope
from ..lag import first_order, second_order

_Pair = tuple[ca.SX, ca.SX]
_MERRITT = "Merritt, Hydraulic Control Systems, Wiley 1967"
_IVANTYSYN = "Ivantysyn, Ivantysynova, Hydrostatic Pumps and Motors, Akademia Books 2001"
_ROUND = 2e3  # Pa, over which a check valve closes

_leakage = partial(
    effect,
    "pump.leakage",
    equation="flow",
    slot="pump_flow",
    shows="the same speeds against several loads, and standing under load with the pump hardly turning",
)
_hose = partial(
    effect,
    "hose.compliance",
    equation="flow",
    slot="hoses",
    shows="changes of load or direction, with pressures and position recorded",
)
_delay = partial(
    effect,
    "selector.delay",
    equation="drive",
    slot="direction",
    shows="changes of direction, sampled faster than the valves switch",
)
_line = partial(
    effect,
    "accumulator.line",
    equation="flow",
    slot="accumulator",
    shows="long fast strokes both ways, with the pressure of the chamber that drains recorded",
)
_losses = partial(
    effect,
    "motor.losses",
    equation="drive",
    slot="motor_losses",
    shows="steady speeds at several voltages without load, with the speed recorded",
)


@_leakage(
    "laminar",
    source=f"{_MERRITT}, ch. 4: leakage of a pump, by laminar gaps",
    numbers=(
        number("C", 3e-13, "m^3/s/Pa", shown="l/min/bar", low=0.0, high=1e-10, off=0.0, meaning="leak per pressure"),
    ),
)
def laminar_leakage(flow: ca.SX, s: Scope) -> ca.SX:
    """Q = D w - (Cp + C) (p - p0): more of the laminar leakage that the rig file declares."""
    return flow - s.p("C") * s["drop"]


@_leakage(
    "orifice",
    source=f"{_IVANTYSYN}, ch. 3: turbulent part of the volumetric losses",
    numbers=(
        number("k", 5e-10, "m^3/s/Pa^0.5", shown="l/min/bar^0.5", low=0.0, high=1e-7, off=0.0, meaning="leak per root"),
    ),
)
def orifice_leakage(flow: ca.SX, s: Scope) -> ca.SX:
    """Q = D w - Cp (p - p0) - k q(p - p0), q the plant's signed root."""
    return flow - s.p("k") * root(s["drop"])


@effect(
    "pump.ripple",
    "sine",
    equation="flow",
    slot="pump_flow",
    source=f"{_IVANTYSYN}, ch. 4: flow pulsation of displacement machines",
    shows="steady slow speeds, with pressures sampled faster than the pump delivers",
    numbers=(
        number("a", 0.05, "1", shown="%", low=0.0, high=0.5, off=0.0, meaning="amplitude over the mean flow"),
        number("n", 7.0, "1", low=1.0, high=30.0, given=True, meaning="deliveries in a turn"),
    ),
    states=(state("angle", "rad", 100.0),),
)
def ripple(flow: ca.SX, s: Scope) -> ca.SX:
    """Q (1 + a sin(n angle)), the angle that of the shaft."""
    s.rate("angle", s["speed"])
    return flow * (1 + s.p("a") * ca.sin(s.p("n") * s.x("angle")))


@_hose(
    "linear",
    source=f"{_MERRITT}, ch. 1: effective bulk modulus of oil in a container that gives",
    numbers=(
        number("CA", 1.5e-12, "m^3/Pa", shown="cm^3/bar", low=0.0, high=1e-10, off=0.0, meaning="of hose A"),
        number("CB", 1.5e-12, "m^3/Pa", shown="cm^3/bar", low=0.0, high=1e-10, off=0.0, meaning="of hose B"),
    ),
)
def linear_hose(compliances: _Pair, s: Scope) -> _Pair:
    """dV/dp = V/beta + CA, and so for B."""
    return compliances[0] + s.p("CA"), compliances[1] + s.p("CB")


@_hose(
    "stiffening",
    source="Johnston, Tilley, Edge, Measurement and modelling of the wave properties of hydraulic hoses, 2010",
    numbers=(
        number(
            "CA", 1.5e-12, "m^3/Pa", shown="cm^3/bar", low=0.0, high=1e-10, off=0.0, meaning="of the hose of A at 0"
        ),
        number(
            "CB", 1.5e-12, "m^3/Pa", shown="cm^3/bar", low=0.0, high=1e-10, off=0.0, meaning="of the hose of B at 0"
        ),
        number("p", 50e5, "Pa", shown="bar", low=1e5, high=1e8, meaning="pressure at which it gives half as much"),
    ),
)
def stiffening_hose(compliances: _Pair, s: Scope) -> _Pair:
    """dV/dp = V/beta + CA/(1 + pA/p), and so for B: a braid that tightens."""
    by_a, by_b = (1 + ca.fmax(s[name], 0) / s.p("p") for name in ("pa", "pb"))
    return compliances[0] + s.p("CA") / by_a, compliances[1] + s.p("CB") / by_b


@_delay(
    "first order",
    source=f"{_MERRITT}, ch. 7: coil and plunger as one lag",
    numbers=(number("tau", 20e-3, "s", shown="ms", low=0.0, high=0.5, off=0.0, meaning="further time constant"),),
    states=(state("d", "1", 1.0),),
)
def first_order_delay(asked: ca.SX, s: Scope) -> ca.SX:
    """tau d' = direction - d, before the switching that the rig file declares."""
    return first_order(asked, s, "d")


@_delay(
    "second order",
    source=f"{_MERRITT}, ch. 7: coil, then plunger",
    numbers=(
        number("tau", 10e-3, "s", shown="ms", low=0.0, high=0.25, off=0.0, meaning="time constant of each of two"),
        number("zeta", 1.0, "1", low=0.5, high=2.0, given=True, meaning="damping ratio"),
    ),
    states=(state("d", "1", 1.0), state("d_rate", "1", 1.0)),
)
def second_order_delay(asked: ca.SX, s: Scope) -> ca.SX:
    """tau^2 d'' + 2 zeta tau d' + d = direction."""
    return second_order(asked, s, "d")


@effect(
    "selector.check",
    "cracking",
    equation="flow",
    slot="delivery_drop",
    source=f"{_MERRITT}, ch. 3: check valve with its spring",
    shows="standing under load with the pump at rest and the valve open, with the pressure of the chamber recorded",
    numbers=(
        number("share", 1.0, "1", shown="%", low=0.0, high=1.0, off=0.0, meaning="of the drop that the valve takes"),
        number("pc", 1e5, "Pa", shown="bar", low=0.0, high=2e6, meaning="pressure that cracks it"),
    ),
)
def cracking(drop: ca.SX, s: Scope) -> ca.SX:
    """A check valve between pump and direction valve: of a drop d only what is above pc passes, and nothing back."""
    over = drop - s.p("pc")
    passed = (over + ca.sqrt(over * over + _ROUND**2)) / 2
    return drop + s.p("share") * (passed - drop)


@_line(
    "one-way throttle",
    source=f"{_MERRITT}, ch. 3: throttle beside a check valve",
    numbers=(number("r", 3.0, "1", low=0.0, high=100.0, off=0.0, meaning="further resistance outwards"),),
)
def one_way_throttle(flow: ca.SX, s: Scope) -> ca.SX:
    """Q/(1 + r) out of the accumulator; into it as it was."""
    return ca.fmin(flow, 0) + ca.fmax(flow, 0) / (1 + s.p("r"))


@_line(
    "turbulent",
    source=f"{_MERRITT}, ch. 3: sudden changes of section",
    numbers=(number("k", 1e5, "s/m^3", low=0.0, high=1e8, off=0.0, meaning="turbulent drop over the laminar one"),),
)
def turbulent_line(flow: ca.SX, s: Scope) -> ca.SX:
    """The Q that solves Q (1 + k |Q|) = (p - p0)/R."""
    return 2 * flow / (1 + ca.sqrt(1 + 4 * s.p("k") * ca.sqrt(flow * flow + 1e-18)))


@effect(
    "accumulator.stiffness",
    "less gas",
    equation="flow",
    slot="gas_stiffness",
    source="Watton, Fundamentals of Fluid Power Control, Cambridge 2009: gas accumulator",
    shows="strokes of several lengths with stops between, with the pressure of the low side recorded",
    numbers=(
        number(
            "s", 3.0, "1", shown="%", low=-0.9, high=20.0, off=0.0, meaning="further stiffness over the declared one"
        ),
    ),
)
def stiffer_gas(stiffness: ca.SX, s: Scope) -> ca.SX:
    """dp/dV (1 + s): less gas than declared, or more."""
    return stiffness * (1 + s.p("s"))


@_losses(
    "dry",
    source=f"{_IVANTYSYN}, ch. 3: torque losses that do not depend on speed",
    numbers=(
        number("T", 0.05, "N m", low=0.0, high=100.0, off=0.0, dry=True, meaning="further torque against the motion"),
    ),
)
def dry_losses(torque: ca.SX, s: Scope) -> ca.SX:
    """T tanh(w/(1 rad/s))."""
    return torque + s.p("T") * ca.tanh(s["speed"])


@_losses(
    "viscous",
    source=f"{_IVANTYSYN}, ch. 3: viscous torque losses",
    numbers=(number("c", 5e-4, "N m s/rad", low=0.0, high=1.0, off=0.0, meaning="further torque per speed"),),
)
def viscous_losses(torque: ca.SX, s: Scope) -> ca.SX:
    """c w."""
    return torque + s.p("c") * s["speed"]
