"""Margins and poles of a linearised loop, as small tables."""

from dataclasses import dataclass

import numpy as np

from ..base.signals import Signal
from ..commands.common.metric_table import MetricView
from ..loop.margins import LinearLoop
from ..loop.rows import LinearLoops, linear_row, moving_at
from ..report import Figure, FrequencyCurve, Table, sensitivity


def _points(signal: Signal) -> tuple[str, str]:
    return "null", f"moving at {moving_at(signal)}"


@dataclass(frozen=True, eq=False, repr=False)
class Margins:
    """Margins of the sampled linear loop at null and moving; the properties are the worse of the two.

    `null` and `moving` are the linear loops of the controlled `signal`, with their responses over frequency. An
    unstable loop has no margins: None. Those of a controller without a linear view come from sines on the simulated
    loop, where these give any.
    """

    null: LinearLoop
    moving: LinearLoop
    signal: Signal

    @property
    def stable(self) -> bool | None:
        """At both operating points; None where that is not known."""
        return self._both.stable

    @property
    def gain_margin_db(self) -> float | None:
        """Least gain margin [dB]."""
        return self._both.worst(min, "gain_margin_db")

    @property
    def phase_margin_deg(self) -> float | None:
        """Least phase margin [deg]."""
        return self._both.worst(min, "phase_margin_deg")

    @property
    def ms(self) -> float | None:
        """Largest peak of the sensitivity [1]."""
        return self._both.worst(max, "ms")

    @property
    def _both(self) -> LinearLoops:
        return LinearLoops(self.null, self.moving)

    def plot(self) -> Figure:
        """The sensitivity of both loops."""
        curves = [
            FrequencyCurve(name, loop.f, loop.sensitivity)
            for name, loop in zip(_points(self.signal), (self.null, self.moving), strict=True)
            if loop.sensitivity is not None
        ]
        return sensitivity("Sensitivity", curves)

    def table(self) -> Table:
        """A row for each operating point."""
        loops = zip(_points(self.signal), (self.null, self.moving), strict=True)
        lines = [{"operating point": name, **linear_row(loop)} for name, loop in loops]
        keys = ("operating point", "stable", "ms", "gain_margin_db", "phase_margin_deg", "f3db_hz", "f90_hz")
        return MetricView(self.signal).table("", lines, keys)

    def __repr__(self) -> str:
        return repr(self.table())

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()


@dataclass(frozen=True, eq=False, repr=False)
class Poles:
    """Poles z [k] of the sampled closed loop of a `signal` at null and moving, `period` [s] apart in time."""

    null: np.ndarray
    moving: np.ndarray
    period: float
    signal: Signal

    @property
    def stable(self) -> bool:
        """Whether all are inside the unit circle."""
        return bool(max(np.abs(self.null).max(), np.abs(self.moving).max()) < 1)

    def table(self, count: int = 6) -> Table:
        """The slowest poles of each point, as frequency and damping of s = ln(z)/T; one of each conjugate pair."""
        rows = [
            [name, abs(z), abs(s) / (2 * np.pi), -s.real / abs(s)]
            for name, poles in zip(_points(self.signal), (self.null, self.moving), strict=True)
            for z, s in self._slowest(poles, count)
        ]
        return Table("", ["operating point", "|z|", "frequency [Hz]", "damping"], rows)

    def _slowest(self, poles: np.ndarray, count: int) -> list[tuple[complex, complex]]:
        upper = poles[(np.imag(poles) >= 0) & (np.abs(poles) > 0)]
        slowest = upper[np.argsort(-np.abs(upper))][:count]
        return [(complex(z), complex(np.log(complex(z)) / self.period)) for z in slowest]

    def __repr__(self) -> str:
        return f"{len(self.null)} poles, {'stable' if self.stable else 'unstable'}; the slowest:\n{self.table()!r}"

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()
