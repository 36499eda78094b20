"""How the numbers of a column become a signal: what its unit and its range say, beside what the rig can do."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import converts, to_si
from ...records.foreign.unit_names import GAUGE
from ...rigs.rig import Rig
from .summary import ColumnSummary

ATMOSPHERE = 101325.0  # Pa
_WIDE, _SMALL = 1.05, 1e-3  # of what the rig can do: no signal goes beyond, and hardly one stays below
_TELLING = 0.1  # of what the rig can do: a column without a unit that goes less far may be in any
PRESSURES = ("pa", "pb", "load_pressure", "supply")
_LEAST_PRESSURE, _MOST_PRESSURE = 0.08, 1.15  # of the supply pressure, at its peak
_BARE: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(PRESSURES, ("bar", "MPa", "psi", "Pa")),
    **dict.fromkeys(("position", "reference"), ("mm", "m")),
    "spool": ("mm", "m", "um"),
    "velocity": ("m/s", "mm/s"),
    "force": ("kN", "N"),
}
"""Units that a column without one may have."""
_CLOCKS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
"""Units of clocks without one, in s."""
_FASTEST, _SLOWEST = 0.08, 1.0  # control periods of the rig, and s, from row to row
_END = 0.03  # of the stroke: how near to 0 a scale begins that begins at an end stop


@dataclass(frozen=True)
class Conversion:
    """value = scale * number + offset, in the unit `to`; `unit` is that of the number, None where there is none.

    is_sure: the unit says it; `problem` is what does not fit the rig.
    """

    unit: str | None
    scale: float
    to: str
    offset: float
    reason: str
    is_sure: bool
    problem: str = ""


def reach(rig: Rig, signal: str) -> float | None:
    """How far a signal of the rig can go, from end to end, SI; None where nothing says."""
    if signal in ("position", "reference"):
        return rig["S"]
    if signal == "spool":
        return 2 * rig["z3max"]
    if signal in PRESSURES:
        return rig["Ps"] * (2 if signal == "load_pressure" else 1)
    if signal in ("velocity", "force"):
        return 2 * {"velocity": rig.limit("speed"), "force": max(rig.areas) * rig["Ps"]}[signal]
    return None


def conversion(column: ColumnSummary, signal: str, rig: Rig) -> Conversion | str:
    """How a column may be a signal; text where it cannot be, or where nothing says how."""
    if not np.isfinite(column.travel):
        return "has no number"
    if signal == "t":
        return _clock(column, rig)
    unit = column.unit
    if signal == "command":
        return _command(column)
    if unit is not None and unit.lower() in GAUGE and signal in PRESSURES:
        return _gauge(column, signal, GAUGE[unit.lower()], rig)
    if unit is None:
        return _without_unit(column, signal, rig)
    if unit in ("%", "percent") and signal == "spool":
        full = 1e3 * rig["z3max"]
        return Conversion(unit, 0.01 * full, "mm", 0.0, f"100 % taken as the full travel of {full:g} mm", False)
    if not converts(unit, SIGNALS[signal].si):
        return f"{unit} is no unit of {signal}"
    return _placed(Conversion(unit, 1.0, unit, 0.0, f"unit {unit}", True), column, signal, rig)


def _clock(column: ColumnSummary, rig: Rig) -> Conversion | str:
    """The unit that a clock says; else the finest one in which its rows are not far faster than the rig's own."""
    if column.step is None:
        return "does not increase from row to row"
    if column.unit is not None:
        if not converts(column.unit, "s"):
            return f"{column.unit} is no unit of time"
        return Conversion(column.unit, 1.0, column.unit, 0.0, f"increases, in {column.unit}", True)
    for unit, size in _CLOCKS.items():
        if _FASTEST * rig.period.value <= column.step * size <= _SLOWEST:
            beside = f"{column.step * size / rig.period.value:.3g} control periods of the rig"
            return Conversion(unit, 1.0, unit, 0.0, f"increases by {column.step:.4g} a row: {unit}, {beside}", False)
    return f"increases by {column.step:.4g} a row, in no unit that a clock has"


def _command(column: ColumnSummary) -> Conversion | str:
    unit, peak = column.unit, column.peak
    if unit == "V":
        if peak <= 10 * _WIDE:
            return Conversion("V", 0.1, "1", 0.0, f"±10 V taken as full command; it reaches {peak:.3g} V", False)
        return f"reaches {peak:.4g} V, and full command is 10 V at most"
    if unit is not None and not converts(unit, "1"):
        return f"{unit} does not say what full command is"
    share = float(to_si(peak, unit or "1", "1"))
    if share <= _WIDE:
        said = f"unit {unit}" if unit else "no unit"
        return Conversion(unit or "1", 1.0, unit or "1", 0.0, f"{said}, within ±1 of full command", unit is not None)
    for full, name in ((10.0, "V"), (100.0, "%")):
        if unit in (None, "1") and full / _WIDE < peak < full * _WIDE:
            return Conversion(unit, 1 / full, "1", 0.0, f"goes to {peak:.4g}: as if {full:g} {name} were full", False)
    return f"reaches {peak:.4g}{f' {unit}' if unit else ', without a unit'}: what is full command?"


def _gauge(column: ColumnSummary, signal: str, unit: str, rig: Rig) -> Conversion | str:
    offset = float(f"{ATMOSPHERE / float(to_si(1.0, unit, 'Pa')):.6g}") if signal != "load_pressure" else 0.0
    plain = Conversion(unit, 1.0, unit, offset, f"unit {column.unit}, above the atmosphere's", True)
    return _placed(plain, column, signal, rig)


def _without_unit(column: ColumnSummary, signal: str, rig: Rig) -> Conversion | str:
    whole = reach(rig, signal)
    if whole is None or signal not in _BARE:
        return "no unit"
    pressure = signal in PRESSURES
    size = column.peak if pressure or signal in ("force", "velocity") else column.travel
    whole = whole / 2 if signal in ("load_pressure", "force", "velocity") else whole
    least, most = (_LEAST_PRESSURE, _MOST_PRESSURE) if pressure else (_SMALL, _WIDE)
    shares = {unit: float(to_si(size, unit, SIGNALS[signal].si)) / whole for unit in _BARE[signal]}
    possible = [unit for unit, share in shares.items() if least < share < most]
    if len(possible) != 1 or shares[possible[0]] < _TELLING:
        named = " or ".join(possible) or f"none of {', '.join(shares)}"
        return f"no unit, and by its range of {size:.4g} it may be {named}, or volts of a sensor"
    unit = possible[0]
    reason = f"no unit; in {unit} it reaches {shares[unit]:.2g} of what the rig can, other units are out of range"
    return _placed(Conversion(unit, 1.0, unit, 0.0, reason, False), column, signal, rig)


def _placed(plain: Conversion, column: ColumnSummary, signal: str, rig: Rig) -> Conversion | str:
    """The conversion with the offset that the rig's origin asks for, or with what does not fit the rig."""
    whole, si = reach(rig, signal), SIGNALS[signal].si
    if whole is None:
        return plain
    low, high = (float(to_si(end + plain.offset, plain.to, si)) for end in (column.low, column.high))
    text = SIGNALS[signal].text
    if signal in ("position", "reference"):
        return _in_stroke(plain, column, rig)
    if signal in ("pa", "pb", "supply"):
        if high > 5 * whole or high < whole / 50:
            return f"reaches {text(_short(high))}, and the supply has {text(whole)}"
        if high > _MOST_PRESSURE * whole:
            return _with(plain, f"reaches {text(_short(high))}, and the supply has {text(whole)}")
        usual = float(to_si(column.usual_low + plain.offset, plain.to, si))
        if usual < -0.02 * whole:
            return _with(plain, f"falls to {text(_short(usual))}: gauge pressure, an offset or a sign")
        return plain
    if high - low > 1.5 * whole:
        return f"goes over {text(_short(high - low))}, and the rig can do {text(_short(whole))}"
    if max(abs(low), abs(high)) > _WIDE * whole / 2:
        return _with(plain, f"goes to {text(_short(max(low, high, key=abs)))}, beyond {text(_short(whole / 2))}")
    return plain


def _in_stroke(plain: Conversion, column: ColumnSummary, rig: Rig) -> Conversion | str:
    """A position within the stroke about the rig's own middle, or from an end stop."""
    stroke = rig["S"]
    low, high = (float(to_si(end, plain.to, "m")) for end in (column.low, column.high))
    if high - low > 1.5 * stroke:
        return f"goes over {1e3 * (high - low):.4g} mm, and the stroke is {1e3 * stroke:.4g} mm"
    first, last = rig.middle - stroke / 2, rig.middle + stroke / 2
    slack = _END * stroke
    if first - slack <= low and high <= last + slack:
        return plain
    if -slack <= low and high <= stroke + slack:
        scale = float(to_si(1.0, plain.to, "m"))
        offset = float(f"{first / scale:.6g}")
        reason = f"{plain.reason}; runs from 0, taken as an end stop: the rig's 0 is {-1e3 * first:.4g} mm from there"
        return Conversion(plain.unit, 1.0, plain.to, offset, reason, False)
    ends = f"{1e3 * low:.4g} to {1e3 * high:.4g} mm, and the rig's stroke is from {1e3 * first:.4g} to {1e3 * last:.4g}"
    return _with(plain, f"goes from {ends} mm; give its offset")


def _with(plain: Conversion, problem: str) -> Conversion:
    return Conversion(plain.unit, plain.scale, plain.to, plain.offset, plain.reason, False, problem)


def _short(value: float) -> float:
    return float(f"{value:.3g}")
