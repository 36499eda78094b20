"""The numbers of controllers and of the rig that can be moved, with their ranges."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from ...base.units import from_si, quantity, to_si
from ...control.controller_spec import ControllerSpec
from ...control.protocol import is_number
from ...loop.tuning.problem import OF_THE_LOOP, Searched
from ...rigs.rig import Rig
from .config import LiveConfig

_SHOWN = {"m": "mm", "s": "ms", "Pa": "bar", "1/Pa": "1/bar", "rad": "deg"}  # where a file gives no unit
_DECADE = 10.0
_TIME = re.compile(r"\b(lead|integral|derivative) time\b|\btime constant\b")  # whose corner is at 1/(2 pi T)
_UNIT = re.compile(r"[-+\d.eE\s]+(.*)")
_OF_RIG = {"M": ("mass", "kg"), "beta": ("oil bulk modulus", "GPa"), "Ps": ("supply pressure", "bar")}


@dataclass(frozen=True)
class Slider:
    """A number: its `value` now, the `bounds` that it may have, the ends `low` and `high` of its slider; in `unit`.

    `path` leads to it from the controller; that of a number of the rig starts with "rig". `log`: the slider is
    logarithmic. corner: "Hz" for a corner frequency, "s" for a time whose corner is at 1/(2 pi T), "" for neither.
    """

    path: tuple[str | int, ...]
    part: str
    meaning: str
    unit: str
    value: float
    bounds: tuple[float, float]
    low: float
    high: float
    log: bool
    corner: str = ""
    to_hz: float = 1.0  # Hz, or s, of the unit
    plain: bool = False  # at its default, which the experiment leaves out

    @property
    def name(self) -> str:
        """gain, or compensators.1.gain of the first compensator."""
        return ".".join(str(key + 1) if isinstance(key, int) else key for key in self.path)


def design_sliders(config: LiveConfig, spec: ControllerSpec) -> list[Slider]:
    """The design numbers of a controller and of its compensators, in their order."""
    table = config.source["controllers"][spec.name]
    searched = {number.path: number for number in config.searched}
    return [_ranged(slider, searched.get(slider.path)) for slider in _numbers(spec, table, ())]


def rig_sliders(rig: Rig) -> list[Slider]:
    """Mass, oil, supply and operating position, as far as a rig has them."""
    sliders = [_of_rig(rig, name) for name in _OF_RIG if name in rig.numbers]
    if rig.is_jack:
        reach = float(from_si(rig.limit("stroke"), "mm", "m"))
        ends = -reach, reach
        sliders.append(Slider(("rig", "position"), "rig", "operating position", "mm", 0.0, ends, *ends, False))
    return sliders


def _of_rig(rig: Rig, name: str) -> Slider:
    meaning, unit = _OF_RIG[name]
    spec, si = rig.specs[name], rig.numbers[name].si
    value, *bounds = (float(from_si(x, unit, si)) for x in (rig[name], spec.low, spec.high))
    low, high = (value / 4, value * 4) if name != "Ps" else (value / 2, value * 1.5)
    ends = max(low, bounds[0]), min(high, bounds[1])
    return Slider(("rig", name), "rig", meaning, unit, value, (bounds[0], bounds[1]), *ends, name != "Ps")


def _numbers(spec: ControllerSpec, table: Mapping[str, Any], path: tuple[str | int, ...]) -> Iterator[Slider]:
    part = spec.use.rpartition(":")[2]
    for entry in filter(is_number, fields(spec.design)):
        yield _slider((*path, entry.name), part, entry.metadata, getattr(spec.design, entry.name), table)
    for key, si in OF_THE_LOOP.items():
        if (value := getattr(spec, key)) is not None:
            metadata = {"unit": si, "low": 1e3, "high": 1e10, "meaning": "stiffness that the loop is designed on"}
            yield _slider((*path, key), part, metadata, value, table)
    for i, inner in enumerate(spec.compensators):
        yield from _numbers(inner, table["compensators"][i], (*path, "compensators", i))


def _slider(
    path: tuple[str | int, ...], part: str, number: Mapping[str, Any], value: float, table: Mapping[str, Any]
) -> Slider:
    si, given = number["unit"], table.get(str(path[-1]))
    unit = _unit(given, si)
    ends = ((value, 0), (number["low"], 1), (number["high"], -1))
    shown, low, high = (_rounded(x, unit, si, inwards) for x, inwards in ends)
    corner = si if si == "Hz" or (si == "s" and _TIME.search(number["meaning"])) else ""
    to_hz = quantity(f"1 {unit}", si) if corner else 1.0
    return Slider(
        path, part, number["meaning"], unit, shown, (low, high), low, high, False, corner, to_hz, given is None
    )


def _rounded(value: float, unit: str, si: str, inwards: int) -> float:
    """To ten digits in a unit; an end of a range not beyond itself, so that what reads it takes it."""
    shown = float(f"{float(from_si(value, unit, si)):.10g}")
    beyond = (float(to_si(shown, unit, si)) - value) * inwards < 0
    return float(f"{shown + inwards * abs(shown) * 1e-9:.10g}") if beyond else shown


def _unit(given: Any, si: str) -> str:
    if isinstance(given, Mapping) and "unit" in given:
        return str(given["unit"])
    if isinstance(given, str) and (match := _UNIT.fullmatch(given)) and match[1]:
        return match[1]
    return _SHOWN.get(si, si)


def _ranged(slider: Slider, searched: Searched | None) -> Slider:
    """With the ends that a search gives it; else a decade each way, within its bounds."""
    if searched is not None:
        return _with_ends(slider, searched.low, searched.high)
    low, high = slider.bounds
    if slider.value > 0:
        low, high = max(low, slider.value / _DECADE), min(high, slider.value * _DECADE)
    return _with_ends(slider, low, high)


def _with_ends(slider: Slider, low: float, high: float) -> Slider:
    """Logarithmic where they are a decade apart; from 0 on the page's script leaves room for 0 at the left end."""
    return replace(slider, low=low, high=high, log=low >= 0 and high >= _DECADE * low * (1 - 1e-9))
