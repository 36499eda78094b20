"""Tables of metrics: a page names the keys; heads, units, digits and what is best come from the metrics themselves."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from ...base.signals import SIGNALS, Signal
from ...loop.metrics import PERIOD, SENSOR, STEP, metric
from ...loop.scenarios import Scenario
from ...report import Known, Table
from ...report.table import Cell
from ...rigs.rig import Rig

MARGINS = ("stable", "ms", "gain_margin_db", "phase_margin_deg", "f3db_hz", "f90_hz", "peak_db", "margins")
_BEST: Mapping[str, Literal["min", "max"]] = {"less": "min", "more": "max"}


@dataclass(frozen=True)
class MetricView:
    """How metrics are read: in the units of a controlled `signal`, to a sensor's `resolution` (SI) and a `period` [s];
    `sizes` (SI) of steps by scenario."""

    signal: Signal = SIGNALS["position"]
    resolution: float = 0.0
    period: float = 0.0
    sizes: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, rig: Rig, signal: Signal, scenarios: Iterable[Scenario] = ()) -> "MetricView":
        """The view of loops of a signal on a rig and its variations."""
        sensor = rig.sensors.get(signal.name)
        resolution = (sensor.resolution or sensor.noise) if sensor else 0.0
        sizes = {scenario.name: abs(scenario.size) for scenario in scenarios}
        return cls(signal, resolution, rig.period.value, sizes)

    def head(self, key: str) -> str:
        """The head of a column, "settling [s]"; a key that is no metric is its own."""
        of = metric(key)
        return of.head(self.signal) if of else key

    def cell(self, row: Mapping[str, Any], key: str) -> Cell:
        """A number of a row as it is shown."""
        value, of = row[key], metric(key)
        if key == "tripped" and value is None:
            return "no"
        if isinstance(value, str | bool) or value is None or of is None or (isinstance(value, int) and not of.unit):
            return value
        factor = of.read_in(self.signal)[1]
        if of.known_to == STEP:
            size = self.sizes.get(row.get("scenario", "")) or abs(row.get("peak_deviation") or 0.0)
            step = 100 * self.resolution / size if size else 0.0
        else:
            step = {SENSOR: factor * self.resolution, PERIOD: self.period}.get(str(of.known_to), of.known_to)
        return Known(float(value) * factor, float(step))

    def number(self, row: Mapping[str, Any], key: str) -> float | None:
        """A number of a row in the unit that people read."""
        of, value = metric(key), row[key]
        return value if of is None or value is None else of.read_in(self.signal)[1] * value

    def text(self, value: float, key: str) -> str:
        """A number with its unit, "12.3 %"."""
        of = metric(key)
        assert of is not None
        unit, factor = of.read_in(self.signal)
        return f"{value * factor:.3g}" + (f" {unit}" if unit not in ("", "1") else "")

    def table(
        self,
        title: str,
        rows: Sequence[Mapping[str, Any]],
        keys: Iterable[str],
        note: str = "",
        best: Sequence[str] = (),
        within: str = "",
        heads: Mapping[str, str] | None = None,
    ) -> Table:
        """The `keys` of rows, those of a scenario together. The best of each `best` is marked, `within` groups or
        scenarios alone; `heads` by key where a page has its own. What all rows say alike is said in the note."""
        columns, own = list(keys), heads or {}
        within = within or ("scenario" if "scenario" in columns else "")
        order = list(dict.fromkeys(row[within] for row in rows)) if within else []
        lines = sorted(rows, key=lambda row: order.index(row[within])) if within else rows
        names = {key: own.get(key) or self.head(key) for key in columns}
        cells = [[self.cell(row, key) for key in columns] for row in lines]
        ways: dict[str, Literal["min", "max"]] = {
            names[key]: _BEST[of.better] for key in best if (of := metric(key)) and of.better
        }
        return Table(title, list(names.values()), cells, note, ways, names.get(within, ""), fold=True)
