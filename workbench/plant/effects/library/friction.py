"""Dry friction: of the jack's seals and bearings (jack.friction) and of the main spool in its bore (main.stiction).

Force [N] against the velocity v [m/s], beside the viscous force that the base plant has. One set of formulas serves
both; they differ in the speed v0 over which the Coulomb step is spread and in what is typical. The spool of a valve
that is known by its datasheet has no mass: there the force is over that of its drive at full command, and the formulas
are "relative ...".
"""

from dataclasses import dataclass, replace
from functools import partial

import casadi as ca

from ..decorator import effect, number, state
from ..effect import Effect, EffectNumber, Scope

_ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30(7), 1994"
_CANUDAS = "Canudas de Wit et al., IEEE Trans. Automatic Control 40(3), 1995, eqs. 1-4, sigma0 = Fc/d, sigma1 = Fc td/d"


@dataclass(frozen=True)
class _Rubbing:
    """What rubs: names, creep speed v0 [m/s], Coulomb force [N]; typical, low, high Stribeck speed, bristle [m]."""

    name: str
    slot: str
    equation: str
    family: str
    shows: str
    creep: float
    typical: float
    highest: float
    stribeck: tuple[float, float, float]
    bristle: tuple[float, float, float]
    unit: str = "N"
    shown: str = "N"
    title: str = ""


_JACK = _Rubbing(
    "jack.friction",
    "friction",
    "force",
    "",
    "slow triangles with reversals, and starts from rest",
    creep=2e-3,
    typical=800.0,
    highest=2e4,
    stribeck=(0.02, 1e-3, 0.5),
    bristle=(4e-5, 1e-6, 1e-3),
)
_SPOOL = _Rubbing(
    "main.stiction",
    "main_friction",
    "main",
    "spool stick",
    "slow triangles of the command, and small steps about a held opening, with current and spool recorded",
    creep=2e-4,
    typical=800.0,
    highest=8e3,
    stribeck=(5e-3, 2e-4, 0.2),
    bristle=(2e-6, 1e-7, 1e-4),
)
_DATASHEET_SPOOL = replace(
    _SPOOL,
    slot="spool_friction",
    shows="slow triangles of the command, and small steps about a held opening, with spool or position recorded",
    typical=0.02,
    highest=0.3,
    unit="1",
    shown="%",
    title="relative ",
)


def _peak(velocity: ca.SX, s: Scope) -> ca.SX:
    """exp(-(v/vs)^2): how much of the break-away force is left."""
    ratio = velocity / s.p("vs")
    return ca.exp(-ratio * ratio)


def _numbers(of: _Rubbing) -> dict[str, EffectNumber]:
    force = partial(number, si=of.unit, shown=of.shown, low=0.0, off=0.0, dry=True)
    fc = force("Fc", of.typical, high=of.highest, meaning="Coulomb friction")
    fs = force("Fs", 1.5 * of.typical, high=2 * of.highest, meaning="break-away friction", at_least="Fc")
    vs, d = (dict(zip(("typical", "low", "high"), r, strict=True)) for r in (of.stribeck, of.bristle))
    known = (
        fc,
        fs,
        number("ratio", 1.5, "1", low=1.0, high=4.0, meaning="break-away over Coulomb friction"),
        number("vs", si="m/s", shown="mm/s", meaning="Stribeck speed", **vs),
        number("d", si="m", shown="um", meaning="deflection at which the bristles carry Fc", **d),
        number("td", 1e-3, "s", shown="ms", low=0.0, high=1e-2, meaning="damping time of the bristles"),
    )
    return {each.name: each for each in known}


def _formulas(of: _Rubbing) -> tuple[Effect, ...]:
    known = _numbers(of)

    def take(*names: str) -> tuple[EffectNumber, ...]:
        return tuple(known[name] for name in names)

    here = partial(effect, of.name, equation=of.equation, family=of.family, slot=of.slot, shows=of.shows)

    @here(f"{of.title}coulomb", source=_ARMSTRONG, numbers=take("Fc"))
    def coulomb(friction: ca.SX, s: Scope) -> ca.SX:
        """F = Fc tanh(v/v0), v0 = 2 mm/s for a jack, 0.2 mm/s for a spool."""
        return friction + s.p("Fc") * ca.tanh(s["velocity"] / of.creep)

    @here(f"{of.title}stribeck", source=_ARMSTRONG, numbers=take("Fc", "Fs", "vs"))
    def stribeck(friction: ca.SX, s: Scope) -> ca.SX:
        """F = [Fc + (Fs - Fc) exp(-(v/vs)^2)] tanh(v/v0), v0 = 2 mm/s for a jack, 0.2 mm/s for a spool."""
        level = s.p("Fc") + (s.p("Fs") - s.p("Fc")) * _peak(s["velocity"], s)
        return friction + level * ca.tanh(s["velocity"] / of.creep)

    @here(
        f"{of.title}lugre",
        source=_CANUDAS,
        numbers=take("Fc", "ratio", "vs", "d", "td"),
        states=(state("z", "1", 1.0, memory=True),),
    )
    def lugre(friction: ca.SX, s: Scope) -> ca.SX:
        """F = Fc (z + td z'), d z' = v - |v| z/g, g = 1 + (ratio - 1) exp(-(v/vs)^2).

        The published LuGre model with its bristle measured in d, the deflection at which it carries Fc: it has no
        quotient of forces, so that Fc may be 0.
        """
        v, z = s["velocity"], s.x("z")
        rate = (v - ca.fabs(v) * z / (1 + (s.p("ratio") - 1) * _peak(v, s))) / s.p("d")
        s.rate("z", rate)
        return friction + s.p("Fc") * (z + s.p("td") * rate)

    return coulomb, stribeck, lugre


spool_coulomb, spool_stribeck, spool_lugre = _formulas(_SPOOL)
relative_coulomb, relative_stribeck, relative_lugre = _formulas(_DATASHEET_SPOOL)
jack_coulomb, jack_stribeck, jack_lugre = _formulas(_JACK)

_newtons = partial(number, si="N", low=0.0, off=0.0, high=_JACK.highest, dry=True)
_pressed = partial(
    effect,
    _JACK.name,
    equation=_JACK.equation,
    slot=_JACK.slot,
    source="Tran, Hafizah, Yanada, Mechatronics 22(1), 2012: friction of hydraulic cylinders grows with pressure",
    shows="slow triangles with reversals, under loads or accelerations that make the pressures differ",
    numbers=(
        _newtons("Fc", 400.0, meaning="Coulomb friction of seals without pressure"),
        _newtons("Fp", 800.0, meaning="what supply pressure on the seals adds"),
    ),
)


def _pushed(friction: ca.SX, s: Scope, pressure: ca.SX) -> ca.SX:
    level = s.p("Fc") + s.p("Fp") * ca.fmax(pressure, 0) / s["feed"]
    return friction + level * ca.tanh(s["velocity"] / _JACK.creep)


@_pressed("pressed by the difference")
def pressed_by_difference(friction: ca.SX, s: Scope) -> ca.SX:
    """F = (Fc + Fp |pA - pB|/Ps) tanh(v/v0), v0 = 2 mm/s: the seal of the piston."""
    return _pushed(friction, s, ca.fabs(s["drop"]))


@_pressed("pressed by the mean")
def pressed_by_mean(friction: ca.SX, s: Scope) -> ca.SX:
    """F = (Fc + Fp max(pA + pB, 0)/(2 Ps)) tanh(v/v0), v0 = 2 mm/s: the seals of two rods."""
    return _pushed(friction, s, s["mean"])


@effect(
    _JACK.name,
    "by direction",
    equation=_JACK.equation,
    slot=_JACK.slot,
    source=f"{_ARMSTRONG}: friction that differs with the sign of the velocity",
    shows=_JACK.shows,
    numbers=(
        _newtons("Fc_out", 1000.0, meaning="Coulomb friction while the rod extends"),
        _newtons("Fc_in", 600.0, meaning="Coulomb friction while it retracts"),
    ),
)
def by_direction(friction: ca.SX, s: Scope) -> ca.SX:
    """F = Fc_out max(T, 0) + Fc_in min(T, 0), T = tanh(v/v0), v0 = 2 mm/s."""
    turned = ca.tanh(s["velocity"] / _JACK.creep)
    return friction + s.p("Fc_out") * ca.fmax(turned, 0) + s.p("Fc_in") * ca.fmin(turned, 0)
