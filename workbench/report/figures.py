"""What a figure shows: curves in stacked panels over one x axis. Plain data; chart.py and still.py draw it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..base.gain_phase import gain_db, phase_deg

Style = Literal["line", "dash", "dot", "markers", "points"]


def _vector(values: object, name: str, length: int | None = None) -> NDArray[np.float64]:
    vector = np.asarray(values, dtype=float)
    if vector.ndim != 1 or (length is not None and len(vector) != length):
        raise ValueError(f'curve "{name}": needs one-dimensional arrays of one length, got shape {vector.shape}')
    return vector


@dataclass(frozen=True, eq=False)
class Curve:
    """`y` over `x` (both (n,), in the units of the axis labels); a NaN or an infinite value is a gap.

    style: "points" is a line with a mark at every sample, of what was computed at these alone. band: low and high, (n,)
    each, shaded behind the curve. color: "#rrggbb", else the page chooses one for the name. visible: False starts the
    curve hidden; its legend entry shows it. Raises ValueError for arrays of different length.
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    style: Style = "line"
    color: str | None = None
    band: tuple[np.ndarray, np.ndarray] | None = None
    visible: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", _vector(self.x, self.name))
        object.__setattr__(self, "y", _vector(self.y, self.name, len(self.x)))
        if self.band is not None:
            low, high = (_vector(edge, self.name, len(self.x)) for edge in self.band)
            object.__setattr__(self, "band", (low, high))


@dataclass(frozen=True)
class Mark:
    """A reference line across a panel at `value` of its y (or x) axis, with a short label."""

    value: float
    label: str = ""
    axis: Literal["x", "y"] = "y"


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over one y axis.

    y_range: (low, high) in the unit of the label; y_step: grid distance where the unit has a natural one (45 deg).
    """

    y_label: str
    curves: Sequence[Curve]
    log_y: bool = False
    y_range: tuple[float, float] | None = None
    marks: Sequence[Mark] = ()
    y_step: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Figure:
    """Panels stacked over one shared x axis.

    Labels end with their unit, "gain [dB]". height: of the whole figure in CSS pixels, else by the number of panels.
    x_names: the values 1, 2 ... of x stand for these names, which the axis then shows. x_range: (first, last), what is
    shown of x at first; the page has all of it.
    """

    title: str
    x_label: str
    panels: Sequence[Panel]
    log_x: bool = False
    note: str = ""
    height: int | None = None
    x_names: Sequence[str] = ()
    x_range: tuple[float, float] | None = None

    def __repr__(self) -> str:
        panels = ", ".join(panel.y_label for panel in self.panels)
        return f'Figure "{self.title}": {panels} over {self.x_label}'

    def _repr_html_(self) -> str:
        from .show import figure_html  # draws with matplotlib, which only pictures wait for

        return figure_html(self)

    def show(self) -> Path | None:
        """Display it in a notebook, else open it in a browser; the path of the page then."""
        from .show import show_figure

        return show_figure(self)

    def save(self, path: str | Path) -> Path:
        """Write it as a .png, .svg or interactive .html file. Raises InputError for another suffix."""
        from .show import save_figure

        return save_figure(self, path)


@dataclass(frozen=True, eq=False)
class FrequencyCurve:
    """A complex response, (n,), at the frequencies f_hz, (n,), ascending, in Hz; NaN where there is none."""

    name: str
    f_hz: np.ndarray
    response: np.ndarray
    style: Style = "line"
    visible: bool = True


def gains(
    title: str, curves: Sequence[FrequencyCurve], label: str = "gain [dB]", note: str = "", marks: Sequence[Mark] = ()
) -> Figure:
    """Gains alone [dB] over frequency: of sensitivities, couplings, errors."""
    shown = [Curve(c.name, c.f_hz, gain_db(c.response), c.style, visible=c.visible) for c in curves]
    return Figure(title, "frequency [Hz]", [Panel(label, shown, marks=marks)], log_x=True, note=note)


def sensitivity(title: str, curves: Sequence[FrequencyCurve]) -> Figure:
    """|S| [dB] of loops over frequency."""
    return gains(title, curves, "|S| [dB]")


def bode(title: str, curves: Sequence[FrequencyCurve], note: str = "") -> Figure:
    """Gain [dB] over phase [deg], with the -3 dB and -90 deg lines that a bandwidth is read at."""

    def panel_curves(values: Sequence[np.ndarray]) -> list[Curve]:
        return [Curve(c.name, c.f_hz, y, c.style, visible=c.visible) for c, y in zip(curves, values, strict=True)]

    gain = panel_curves([gain_db(c.response) for c in curves])
    phase = panel_curves([phase_deg(c.response) for c in curves])
    panels = (
        Panel("gain [dB]", gain, marks=(Mark(-3.0, "-3 dB"),)),
        Panel("phase [deg]", phase, marks=(Mark(-90.0, "-90°"),), y_step=45.0),
    )
    return Figure(title, "frequency [Hz]", panels, log_x=True, note=note)
