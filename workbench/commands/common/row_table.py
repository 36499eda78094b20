"""Rows of metrics.json of loops, as a table of a report: heads with units, numbers to what the sensors resolve."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ...base.signals import Signal
from ...base.units import from_si
from ...loop.scenarios import Scenario
from ...report import Known, Table
from ...report.table import Cell
from ...rigs.rig import Rig

_SECONDS = ("settling_s", "rise_s", "saturated_s", "cavitation_s")
_OF_THE_SIGNAL = ("steady_state_error", "band", "peak_deviation")
_OF_THE_STEP = {"overshoot_percent": 1.0, "residual_oscillation": 100.0}  # and what makes them percent
_STEPS = {"ms": 0.01, "gain_margin_db": 0.01, "phase_margin_deg": 0.1, "peak_db": 0.01}
_HEADS = {
    "settling_s": "settling [s]",
    "times_limit": "times the limit [1]",
    "overshoot_percent": "overshoot [%]",
    "rise_s": "rise [s]",
    "peak_command": "peak command [1]",
    "saturated_s": "limited [s]",
    "cavitation_s": "cavitation [s]",
    "residual_oscillation": "oscillation [% of step]",
    "f3db_hz": "-3 dB [Hz]",
    "f90_hz": "-90° [Hz]",
    "peak_db": "peak [dB]",
    "gain_margin_db": "gain margin [dB]",
    "phase_margin_deg": "phase margin [deg]",
    "ms": "Ms [1]",
    "margins": "margins by",
}
MARGINS = ("stable", "ms", "gain_margin_db", "phase_margin_deg", "f3db_hz", "f90_hz", "peak_db", "margins")


class RowTable:
    """Makes tables of the rows of loops of one signal on a rig and its variations, in scenarios."""

    def __init__(self, rig: Rig, signal: Signal, scenarios: Iterable[Scenario]) -> None:
        sensor = rig.sensors.get(signal.name)
        self._step = (sensor.resolution or sensor.noise) if sensor else 0.0
        self._period, self._signal = rig.period.value, signal
        self._sizes = {scenario.name: abs(scenario.size) for scenario in scenarios}

    def table(
        self,
        title: str,
        rows: Sequence[Mapping[str, Any]],
        keys: Sequence[str],
        note: str = "",
        best: Sequence[str] = (),
    ) -> Table:
        """The `keys` of rows, those of a scenario together; the least of each `best` is marked within a scenario."""
        order = list(dict.fromkeys(row["scenario"] for row in rows))
        lines = sorted(rows, key=lambda row: order.index(row["scenario"]))
        heads = [self.head(key) for key in keys]
        cells = [[self.cell(row, key) for key in keys] for row in lines]
        within = "scenario" if "scenario" in keys else ""
        return Table(title, heads, cells, note, dict.fromkeys(map(self.head, best), "min"), within, fold=True)

    def head(self, key: str) -> str:
        """The head of a column."""
        unit = self._signal.unit
        own = {
            "steady_state_error": f"final error [{unit}]",
            "iae": f"IAE [{unit} s]",
            "rms_error": f"RMS error [{unit}]",
            "band": f"band [{unit}]",
        }
        own |= {"peak_deviation": f"peak deviation [{unit}]"}
        return own.get(key) or _HEADS.get(key, key)

    def cell(self, row: Mapping[str, Any], key: str) -> Cell:
        """A number of a row as it is shown."""
        value = row[key]
        if key == "tripped":
            return value or "no"
        if isinstance(value, str | bool) or value is None:
            return value
        if key in _SECONDS:
            return Known(value, self._period)
        if key in _OF_THE_SIGNAL:
            return Known(self._shown(value), self._shown(self._step))
        if key in _OF_THE_STEP:
            size = self._sizes.get(row["scenario"]) or abs(row.get("peak_deviation") or 0.0)  # what a load pushes
            return Known(value * _OF_THE_STEP[key], 100 * self._step / size if size else 0.0)
        return self._shown(value) if key in ("iae", "rms_error") else Known(value, _STEPS.get(key, 0.0))

    def _shown(self, value: float) -> float:
        return float(from_si(value, self._signal.unit, self._signal.si))
