"""What the outputs of a linear plant are measured in: any quantity in the place of a position, and its derivatives."""

import re
from collections.abc import Mapping
from dataclasses import replace

from ..base.errors import InputError, echo
from ..base.signals import SIGNALS, Signal
from ..base.units import Spec, converts, to_si
from . import schema

_ANGLES = ("rad", "rad/s")
_KINDS = ("m", "N", "Pa", "V", "A", "N m", "degC", "K", "m/s", "m^3/s", "W", "1")
_RATES = {"position": "", "velocity": "/s", "acceleration": "/s^2"}
_ANGLE = re.compile(r"\b(rad|deg|degree|rev|turn|rpm)s?\b")
_RANGE = 1e-12, 1e12


def measured_as(unit: str) -> str:
    """The SI unit of a position that is measured in a `unit`: "m", "rad", "N", ... Raises InputError."""
    for si in _ANGLES if _ANGLE.search(unit) else _KINDS:
        if _converts(unit, si):
            return si
    kinds = ", ".join(kind for kind in (*_ANGLES, *_KINDS) if kind != "m")
    raise InputError(f"a position in {echo(unit)}: write a unit of m, or of one of {kinds}")


def output_signals(units: Mapping[str, str], si: str) -> dict[str, Signal]:
    """The signals of outputs that are written in `units`, of a position in `si`: a length is shown as every rig's."""
    signals = {name: SIGNALS[name] for name in _RATES}
    if si == "m":
        return signals
    shown = units.get("position", si)
    meaning = "the plant's output"
    return {
        name: replace(SIGNALS[name], si=f"{si}{rate}", unit=f"{shown}{rate}", meaning=meaning)
        for name, rate in _RATES.items()
    }


_OF_OIL = ("flow_error", "pressure", "least_pressure")


def limit_specs(si: str) -> Mapping[str, Spec]:
    """Unit, range and meaning of the limits of a plant whose position is in `si`."""
    shared = {name: spec for name, spec in schema.LIMITS.items() if name not in _OF_OIL}
    if si == "m":
        return shared
    own = {
        "stroke": Spec(si, *_RANGE, "allowed distance from rest"),
        "speed": Spec(f"{si}/s", *_RANGE, "allowed rate of the position"),
        "following_error": Spec(si, *_RANGE, schema.LIMITS["following_error"].meaning),
    }
    return {**shared, **own}


def _converts(unit: str, si: str) -> bool:
    """Also whether both are 0 together."""
    return converts(unit, si) and not to_si(0.0, unit, si)
