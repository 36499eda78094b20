"""The figures of a rig's sheet, and their intervals: what the bounds of its numbers leave open, to first order."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...identify.acceptance.row import Estimate, Row, measured, unsaid
from ...loop.performance.bounds import Drive, PerformanceEnvelope, envelope
from ...loop.performance.carried import carried_by_jack
from ...loop.performance.drive import Demands, accumulator, demands, lacking
from ...rigs.rig import Rig
from .config import CapabilityAsked, DriveAsked

FREQUENCIES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
_UNIFORM = float(np.sqrt(12.0))
_PER_MINUTE = 60000.0


@dataclass(frozen=True)
class CapabilityLine:
    """A line before it is known how well: its SI value times `scale` in `unit`; None and why."""

    meaning: str
    unit: str
    scale: float
    value: float | None
    reason: str = ""


def spoken(f: float) -> str:
    """A frequency in a line's name."""
    return f"{f:g}hz".replace(".", "_")


def said_frequencies(rig: Rig) -> np.ndarray:
    """Those of FREQUENCIES [k] Hz with ten samples a cycle."""
    f = np.array(FREQUENCIES)
    return f[f * rig.period.value <= 0.1]


def jack_figures(rig: Rig, asked: CapabilityAsked, drive: Drive) -> dict[str, CapabilityLine]:
    """The figures of the envelope and of the drive file."""
    f = said_frequencies(rig)
    figures = envelope_figures(envelope(carried_by_jack(rig, f), drive))
    if asked.drive is not None:
        figures |= drive_figures(demands(rig, asked.drive.position, asked.drive.band), asked.drive, asked.pump)
    return figures


def envelope_figures(own: PerformanceEnvelope) -> dict[str, CapabilityLine]:
    """The largest sines, and the force at a load cell or at the piston that belongs to them."""
    amplitude, figures = own.amplitude, dict[str, CapabilityLine]()
    for k, f in enumerate(own.f.tolist()):
        meaning = f"largest sine of position at {f:g} Hz, bound by {own.binding[k]}"
        figures[f"displacement_{spoken(f)}"] = CapabilityLine(meaning, "mm", 1e3, float(amplitude[k]))
    for k, f in enumerate(own.f.tolist()):
        force, what = (own.cell, "load cell") if own.cell.any() else (own.pressure, "piston")
        figures[f"force_{spoken(f)}"] = CapabilityLine(
            f"amplitude of the force at the {what} with it, {f:g} Hz", "kN", 1e-3, float(force[k] * amplitude[k])
        )
    return figures


def drive_figures(need: Demands, drive: DriveAsked, pump: float | None) -> dict[str, CapabilityLine]:
    """Power, flow, heat and opening; the accumulator of the pump."""
    mean, opening = float(need.flow.mean()), float(need.lands.opening.max())
    beyond = "" if np.isfinite(opening) else "the force is beyond what the supply gives, whatever the valve"
    figures = {
        "power_mean": CapabilityLine("mean power out of the supply", "kW", 1e-3, float(need.power.mean())),
        "power_peak": CapabilityLine("largest power out of the supply", "kW", 1e-3, float(need.power.max())),
        "flow_mean": CapabilityLine("mean flow out of the supply", "l/min", _PER_MINUTE, mean),
        "flow_peak": CapabilityLine("largest flow out of the supply", "l/min", _PER_MINUTE, float(need.flow.max())),
        "heat": CapabilityLine("mean power that heats the oil", "kW", 1e-3, need.heat),
        "opening_peak": CapabilityLine("largest opening of the valve", "%", 100.0, None if beyond else opening, beyond),
    }
    if pump is not None:
        oil = lacking(need.flow, need.rig.period.value, pump)
        gas = None if oil is None else accumulator(oil, need.rig["Ps"], drive.sag)
        why = f"the pump gives {pump * _PER_MINUTE:.4g} l/min, less than the mean"
        meaning = f"accumulator beside the pump, the supply falling by {100 * drive.sag:g} %"
        figures["accumulator"] = CapabilityLine(meaning, "l", 1e3, gas, why if gas is None else "")
    return figures


def rows_with_bounds(rig: Rig, figures: Callable[[Rig], Mapping[str, CapabilityLine]]) -> list[Row]:
    """Lines of figures: each number's bounds count as a uniform spread, and their effects add as independent ones do.

    Where a number's spread leaves a figure unsaid, it counts as none.
    """
    own, moved = figures(rig), list[Mapping[str, CapabilityLine]]()
    for name, number in rig.numbers.items():
        if number.low is not None and number.high is not None and number.high > number.low:
            spread = (number.high - number.low) / _UNIFORM
            moved.append(figures(rig.with_values(**{name: number.value + spread})))
    return [_row(id, figure, [each[id] for each in moved]) for id, figure in own.items()]


def _row(id: str, figure: CapabilityLine, moved: Sequence[CapabilityLine]) -> Row:
    value = figure.value
    if value is None:
        return unsaid(id, figure.meaning, figure.unit, figure.reason)
    squares = sum((each.value - value) ** 2 for each in moved if each.value is not None)
    estimate = Estimate(value, float(np.sqrt(squares)))
    return measured(id, figure.meaning, figure.unit, estimate, figure.scale, positive=True)
