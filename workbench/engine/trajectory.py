"""What a run gives: states over time, and every output by name with its unit."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..base.columns import data_frame, lookup
from ..base.signals import output_signal
from ..plant import Plant

if TYPE_CHECKING:
    import pandas  # pyright: ignore[reportMissingImports]


@dataclass(frozen=True)
class Trajectory:
    """States x [k + 1, n] at times t [k + 1], all SI; `failed_at` is the time from which they are NaN, or None.

    `run["position"]` is an output, a state or an input by name, [k + 1]: outputs and inputs at t_j are those under the
    input held from t_j on, row j of `u`; `p` [np] are the parameters of the run.
    """

    t: np.ndarray
    x: np.ndarray
    attempts: int
    failed_at: float | None
    plant: Plant
    u: np.ndarray
    p: np.ndarray

    @property
    def ok(self) -> bool:
        """Whether the whole run was integrated."""
        return self.failed_at is None

    @cached_property
    def units(self) -> Mapping[str, str]:
        """SI unit of everything that has a name."""
        variables = {variable.name: variable.unit for variable in (*self.plant.states, *self.plant.inputs)}
        return variables | {name: output_signal(name).si for name in self.plant.outputs}

    @cached_property
    def signals(self) -> Mapping[str, np.ndarray]:
        """Every output by name [k + 1]."""
        y = self.plant.observe(self.x, self._inputs, self.p)
        return dict(zip(self.plant.outputs, y.T, strict=True))

    def __getitem__(self, name: str) -> np.ndarray:
        """An output, or else a state or an input [k + 1]. Raises KeyError that names the nearest there is."""
        lookup(self.units, name, f"signal of {self.plant.name}")
        if name in self.signals:
            return self.signals[name]
        for values, variables in ((self.x, self.plant.states), (self._inputs, self.plant.inputs)):
            for column, variable in zip(values.T, variables, strict=True):
                if variable.name == name:
                    return column
        raise KeyError(name)

    def to_pandas(self) -> "pandas.DataFrame":
        """Time and every output, units in the headers. Raises InputError where pandas is not installed."""
        columns = {"t [s]": self.t} | {f"{name} [{self.units[name]}]": y for name, y in self.signals.items()}
        return data_frame(columns)

    @property
    def _inputs(self) -> np.ndarray:
        """Inputs [k + 1, m]; the last one is held on where `u` ends with the last interval."""
        rows = np.minimum(np.arange(len(self.t)), len(self.u) - 1)
        return self.u[rows]

    def __repr__(self) -> str:
        """One line: plant, span, rows, and where it failed."""
        end = "" if self.ok else f", failed at {self.failed_at:g} s"
        span = f"{self.t[0]:g} to {self.t[-1]:g} s" if len(self.t) else "no time"
        return f"<Trajectory of {self.plant.name}: {span}, {len(self.t)} rows, {self.attempts} attempts{end}>"
