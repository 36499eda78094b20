"""The closed loop's frequency response: linear, and by stepped sine at a stated amplitude."""

from dataclasses import dataclass

import numpy as np

from ..base.gain_phase import gain_db, phase_deg
from ..base.signals import Signal
from ..commands.common.loop_margins import closed_curves
from ..commands.common.sines import closed_loop_figure, packed
from ..linear.crossings import corner_frequency
from ..linear.frequency_response import SteppedSine
from ..loop.rows import LinearLoops
from ..report import Figure


@dataclass(frozen=True, eq=False, repr=False)
class ClosedLoopBode:
    """Reference -> controlled signal, complex [k] at `f` [k] in Hz: linear at null, or by stepped sine.

    `sine` tells at which frequencies a limit acted or a point did not settle; None for a linear one.
    """

    name: str
    signal: Signal
    linear: LinearLoops
    f: np.ndarray
    response: np.ndarray
    sine: SteppedSine | None
    amplitude: str

    @property
    def f3db(self) -> float | None:
        """Frequency [Hz] at which the gain falls through -3 dB."""
        return corner_frequency(self.f, gain_db(self.response), -3.0)

    @property
    def f90(self) -> float | None:
        """Frequency [Hz] at which the phase falls through -90 deg."""
        return corner_frequency(self.f, phase_deg(self.response), -90.0)

    def plot(self) -> Figure:
        """Gain and phase; a stepped sine beside the linear loops, dashed."""
        swept = {} if self.sine is None else {self.amplitude: packed(self.sine, self.signal.name)}
        return closed_loop_figure(self.name, closed_curves(self.linear, self.signal), swept)

    def __repr__(self) -> str:
        corners = (f"{name} at {f:.3g} Hz" for name, f in (("-3 dB", self.f3db), ("-90 deg", self.f90)) if f)
        how = f"stepped sine of {self.amplitude}" if self.sine else "linear, at null"
        return f"closed loop of {self.name}, {how}: {', '.join(corners) or 'no corner'}"

    def _repr_html_(self) -> str:
        return self.plot()._repr_html_()
