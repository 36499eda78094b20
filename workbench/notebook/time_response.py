"""What a loop did over time, with its signals by name and its metrics as one row."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.columns import data_frame, lookup
from ..base.signals import Signal
from ..commands.common.metric_table import MetricView
from ..commands.common.time_figure import run_columns, time_figure
from ..loop.rows import judge
from ..loop.sampled_loop import LoopRun
from ..loop.scenarios import Scenario
from ..records import Record
from ..report import Figure, Table

if TYPE_CHECKING:
    import pandas  # pyright: ignore[reportMissingImports]

    from .closed_loop import ClosedLoop


@dataclass(frozen=True, eq=False, repr=False)
class TimeResponse:
    """A run of a loop: `response["position"]` is a signal [k] at times `t` [k] s, all SI; `record` holds them all.

    `tripped` says why the guard stopped the loop, or None. `seed` is that of the sensors' noise; the signals are true.
    """

    loop: "ClosedLoop"
    scenario: Scenario
    run: LoopRun
    seed: int = 0

    @property
    def record(self) -> Record:
        """Reference, realised command and every output of the plant."""
        return self.run.record

    @property
    def t(self) -> np.ndarray:
        """Times [k] s."""
        return self.record.t

    @property
    def tripped(self) -> str | None:
        """Why the guard stopped the loop, or that the simulation failed."""
        return self.run.tripped

    def __getitem__(self, name: str) -> np.ndarray:
        """A signal [k] in SI. Raises KeyError with the nearest name."""
        return lookup(self.record.signals, name, "signal")

    @cached_property
    def metrics(self) -> "Metrics":
        """Step metrics and margins as one row, by the keys of metrics.json."""
        loop = self.loop
        noise = loop.conditions(self.seed).noise
        return Metrics(judge(loop.controller, self.scenario, loop.setup, loop.linear_loops, noise)[1], loop.signal)

    def plot(self, *signals: str) -> Figure:
        """The controlled signal, then `signals`, or command and pressure. Raises KeyError with the nearest name."""
        for name in signals:
            self[name]
        names = signals or ("command", "pa")
        title = f"{self.scenario.name} on {self.loop.rig.name}"
        return time_figure(title, self.loop.signal, {self.loop.controller.name: run_columns(self.record)}, names)

    def to_pandas(self) -> "pandas.DataFrame":
        """Every signal in SI, its unit in the column's name. Raises InputError where pandas is not installed."""
        units = {"reference": self.loop.signal.si}
        names = {name: f"{name} [{units.get(name, self.loop.rig.signal(name).si)}]" for name in self.record.signals}
        return data_frame({"t [s]": self.t, **{names[name]: values for name, values in self.record.signals.items()}})

    def __repr__(self) -> str:
        end = f"; {self.tripped}" if self.tripped else ""
        return (
            f"{self.loop.controller.name} on {self.loop.rig.name}: {self.scenario.name}, {self.t[-1]:g} s in "
            f"{len(self.t)} samples{end}\nsignals: {', '.join(self.record.signals)}"
        )

    def _repr_html_(self) -> str:
        return self.plot()._repr_html_()


class Metrics(Mapping[str, Any]):
    """A row of metrics by the keys of metrics.json, SI but for what a key says; None where a metric does not exist.

    A name that is not there raises KeyError with the nearest one.
    """

    def __init__(self, values: Mapping[str, Any], signal: Signal) -> None:
        self._values, self._signal = dict(values), signal

    def __getitem__(self, name: str) -> Any:
        return lookup(self._values, name, "metric")

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def table(self) -> Table:
        """The numbers that a loop is judged by."""
        return metrics_table([self._values], self._signal)

    def to_pandas(self) -> "pandas.DataFrame":
        """One row. Raises InputError where pandas is not installed."""
        return data_frame({name: [value] for name, value in self._values.items()})

    def __repr__(self) -> str:
        return repr(self.table())

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()


def metrics_table(rows: list[dict[str, Any]], signal: Signal, *names: str) -> Table:
    """Rows of metrics with the columns `names`, then the numbers that a loop is judged by, in the signal's unit."""
    keys = ("settling_s", "band", "overshoot_percent", "rise_s", "iae", "peak_command", "stable", "ms")
    keys += ("gain_margin_db", "phase_margin_deg")
    return MetricView(signal).table("", rows, (*names, *keys))
