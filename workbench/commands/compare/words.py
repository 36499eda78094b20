"""Metrics of runs that are compared, as an engineer says them: a name, a unit, and what is no change."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...loop.scenarios import SCENARIOS
from ...report import Known
from ...report.table import Cell

_NAMES = {
    "settling_s": "settling", "rise_s": "rise", "saturated_s": "time at a limit", "cavitation_s": "cavitation",
    "overshoot_percent": "overshoot", "residual_oscillation": "lasting oscillation", "iae": "IAE", "ms": "Ms",
    "steady_state_error": "final error", "peak_deviation": "peak deviation", "peak_command": "peak command",
    "band": "band", "f3db_hz": "-3 dB", "f90_hz": "-90°", "peak_db": "peak", "gain_margin_db": "gain margin",
    "phase_margin_deg": "phase margin", "rms": "RMS error", "floor": "noise floor", "ratio": "error over noise",
}  # fmt: skip
_UNITS = {"_s": "s", "_percent": "%", "_hz": "Hz", "_db": "dB", "_deg": "deg", "_ms": "ms", "_us": "us"}
_OF_THE_SIGNAL = ("steady_state_error", "peak_deviation", "band")
_LEAST = {"s": 1e-3, "%": 0.1, "Hz": 0.05, "dB": 0.05, "deg": 0.5, "mm": 0.01, "kN": 0.01, "% of step": 0.1}
TELLING = ("settling_s", "overshoot_percent", "ms", "rms", "f90_hz", "f3db_hz", "f90", "f3db", "value", "chi2", "iae")


@dataclass(frozen=True)
class Metric:
    """How a metric is shown: `name`, `unit`, the `factor` from metrics.json to it, and the `least` change that counts,
    0 where every change does."""

    name: str
    unit: str
    factor: float
    least: float

    def cell(self, value: object) -> Cell:
        """A value as a cell of a table."""
        if isinstance(value, bool | str) or value is None:
            return value
        assert isinstance(value, int | float)
        return Known(value * self.factor, self.least)

    def text(self, value: object) -> str:
        """A value with its unit."""
        shown = "never" if value is None else f"{self.cell(value)}"
        return f"{shown} {self.unit}" if self.unit != "1" and value is not None else shown

    def is_change(self, difference: float) -> bool:
        """Whether a difference is one that counts."""
        return abs(difference * self.factor) > self.least


def metric(row: Mapping[str, Any]) -> Metric:
    """Of a row of differences, by its metric, its unit and the signal of its scenario."""
    key = str(row["metric"])
    name = _NAMES.get(key, key)
    if key in _OF_THE_SIGNAL or key == "iae":
        scenario = SCENARIOS.get(str(row.get("scenario")))
        known = str(row.get("scenario", "")).startswith("force")
        signal = SIGNALS[scenario.signal if scenario else "force" if known else "position"]
        unit = f"{signal.unit} s" if key == "iae" else signal.unit
        return Metric(name, unit, float(from_si(1.0, signal.unit, signal.si)), _LEAST.get(unit, 0.0))
    if key == "residual_oscillation":
        return Metric(name, "% of step", 100.0, _LEAST["% of step"])
    unit = next((unit for end, unit in _UNITS.items() if key.endswith(end) and key != "rms"), "1")
    if unit == "1" and key in ("value", "rms", "floor") and isinstance(row.get("unit"), str):
        unit = row["unit"]
    return Metric(name, unit, 1.0, _LEAST.get(unit, 0.0))
