"""What a comparison of frequency responses shows: rows, a Bode plot with bands, a page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.signals import SIGNALS
from ...identify.data.frequency_response import between
from ...report import Curve, Figure, Page, Panel, Section, Table


@dataclass(frozen=True, eq=False)
class Comparison:
    """One comparison at f [k] Hz, responses [k] complex in the units that people read, NaN where there is none."""

    name: str
    pair: tuple[str, str]
    f: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    how: str
    coherence: np.ndarray | None = None
    radius: np.ndarray | None = None
    linear: Mapping[str, np.ndarray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    h2: np.ndarray | None = None
    units: tuple[str, str] | None = None

    @property
    def unit(self) -> str:
        """Unit of the gain."""
        below, above = self.units or [SIGNALS[name].unit for name in self.pair]
        return above if below == "1" else f"{above}/{below}"


def _beside(comparison: Comparison, response: np.ndarray) -> np.ndarray:
    """Phase [deg] of another response, by whole turns next to the measured one."""
    phase, other = np.degrees(np.angle(response)), phase_deg(comparison.measured)
    return phase - 360 * np.round((phase - other) / 360)


def _edges(comparison: Comparison) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lowest and highest gain [dB] and half width of the phase [deg] of the 95 % circle."""
    size = np.abs(comparison.measured)
    if comparison.radius is None:
        none = np.full(size.size, np.nan)
        return none, none, none
    share = np.minimum(comparison.radius / np.maximum(size, 1e-300), 1.0)
    spread = np.where(share < 1, np.degrees(np.arcsin(share)), 180.0)
    return gain_db(np.maximum(size - comparison.radius, 0.0)), gain_db(size + comparison.radius), spread


def columns(comparison: Comparison) -> dict[str, np.ndarray]:
    """Columns [k] by the keys of metrics.json."""
    low, high, _ = _edges(comparison)
    others = {} if comparison.h2 is None else {"h2": comparison.h2, "hv": between(comparison.measured, comparison.h2)}
    return {
        "f_hz": comparison.f,
        "gain_db": gain_db(comparison.measured),
        "gain_low_db": low,
        "gain_high_db": high,
        "phase_deg": phase_deg(comparison.measured),
        "coherence": np.full(comparison.f.size, np.nan) if comparison.coherence is None else comparison.coherence,
        "model_gain_db": gain_db(comparison.model),
        "model_phase_deg": _beside(comparison, comparison.model),
        **{f"{name}_gain_db": gain_db(response) for name, response in others.items()},
    }


def rows(comparison: Comparison) -> list[dict[str, Any]]:
    """The rows of metrics.json."""
    named = {"record": comparison.name, "input": comparison.pair[0], "output": comparison.pair[1]}
    table = columns(comparison)
    return [named | dict(zip(table, map(float, row), strict=True)) for row in zip(*table.values(), strict=True)]


def _inside(comparison: Comparison) -> int | None:
    """Lines at which the model is inside the 95 % circle."""
    if comparison.radius is None:
        return None
    with np.errstate(invalid="ignore"):
        return int(np.sum(np.abs(comparison.model - comparison.measured) <= comparison.radius))


def _furthest(comparison: Comparison) -> tuple[float, float] | None:
    """Largest difference of gain [dB] where the band is narrower than half of it, and its frequency [Hz]."""
    apart = np.abs(gain_db(comparison.model) - gain_db(comparison.measured))
    if comparison.radius is not None:
        apart[comparison.radius >= np.abs(comparison.measured) / 2] = np.nan
    if not np.isfinite(apart).any():
        return None
    worst = int(np.nanargmax(apart))
    return float(apart[worst]), float(comparison.f[worst])


def figure(comparison: Comparison) -> Figure:
    """Gain and phase with the 95 % band, the model and its linear views; coherence where there is one."""
    low, high, spread = _edges(comparison)
    phase = phase_deg(comparison.measured)
    floor = np.nanmin(np.concatenate((gain_db(comparison.measured), gain_db(comparison.model)))) - 20
    wide = (np.where(np.isfinite(low), low, floor), high)  # a circle that holds the origin has no lower edge
    banded = comparison.radius is not None
    others = {"model": comparison.model, **comparison.linear}
    gain, turn = (
        [Curve("measured", comparison.f, gain_db(comparison.measured), "markers", band=wide if banded else None)],
        [Curve("measured", comparison.f, phase, "markers", band=(phase - spread, phase + spread) if banded else None)],
    )
    for name, response in others.items():
        style = "dash" if name in comparison.linear else "line"
        gain.append(Curve(name, comparison.f, gain_db(response), style))
        own = comparison.units is not None and style == "dash"  # without its delay it is whole turns away
        turn.append(Curve(name, comparison.f, phase_deg(response) if own else _beside(comparison, response), style))
    if comparison.h2 is not None:
        gain.append(Curve("measured, H2", comparison.f, gain_db(comparison.h2), "dash"))
    panels = [Panel(f"gain re 1 {comparison.unit} [dB]", gain), Panel("phase [deg]", turn, y_step=45.0)]
    if comparison.coherence is not None:
        panels.append(
            Panel(
                "coherence [1]", [Curve("measured", comparison.f, comparison.coherence, "markers")], y_range=(0, 1.05)
            )
        )
    note = "; ".join(filter(None, ("shaded: 95 % band" if banded else "", *comparison.notes)))
    title = f"{comparison.name}: {comparison.pair[1]} over {comparison.pair[0]}"
    return Figure(title, "frequency [Hz]", panels, log_x=True, note=note)


def page(source: str, rig: str, comparisons: Sequence[Comparison], said: str = "") -> Page:
    """The report; `said` comes before what the comparisons say."""
    lines = []
    for comparison in comparisons:
        apart, where = _furthest(comparison) or (None, None)
        lines.append([comparison.name, comparison.f.size, _inside(comparison), apart, where, comparison.how])
    summary = Table(
        "Measured against model",
        ["record", "frequencies", "model inside the band", "largest difference [dB]", "at [Hz]", "measured by"],
        lines,
        note=" ".join(_played(comparisons)),
    )
    below, above = comparisons[0].pair
    sections = [Section("Summary", [summary]), Section("Bode", [figure(comparison) for comparison in comparisons])]
    return Page(f"{above} over {below}: {source} and {rig}", said + _verdict(rig, comparisons), sections)


def _played(comparisons: Sequence[Comparison]) -> list[str]:
    """What the model was asked beside records, which have a band, and beside sheets, which have none."""
    banded = {comparison.radius is not None for comparison in comparisons}
    if comparisons[0].units:
        return ["The difference is where the band is narrower than half of the response."]
    record = "Beside a record the model is driven by its recorded command and goes through the same estimator; the "
    record += "difference is where the band is narrower than half of the response."
    return [record] * (True in banded) + ["Beside a sheet it plays the sheet's sines."] * (False in banded)


def _verdict(rig: str, comparisons: Sequence[Comparison]) -> str:
    parts = []
    for comparison in comparisons:
        far = _furthest(comparison)
        if not np.isfinite(comparison.model).any():
            parts += [] if comparison.units else [f"{comparison.name}: the model of {rig} fails"]
            continue
        if far is None:
            wide = "the 95 % band is nowhere narrower than half of the response"
            parts.append(f"{comparison.name}: {wide}, so that no difference is told")
            continue
        inside = (
            ""
            if comparison.radius is None
            else f"inside the 95 % band at {_inside(comparison)} of {comparison.f.size} frequencies, "
        )
        parts.append(f"{comparison.name}: the model is {inside}furthest off by {far[0]:.2g} dB at {far[1]:.3g} Hz")
    return "; ".join(parts) + "." * bool(parts)
