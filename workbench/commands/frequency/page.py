"""What a comparison of frequency responses shows: rows, a Bode plot with bands, a page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.signals import SIGNALS
from ...report import Curve, Figure, Page, Panel, Section, Table


@dataclass(frozen=True, eq=False)
class Found:
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


def _beside(found: Found, response: np.ndarray) -> np.ndarray:
    """Phase [deg] of another response, by whole turns next to the measured one."""
    phase, other = np.degrees(np.angle(response)), phase_deg(found.measured)
    return phase - 360 * np.round((phase - other) / 360)


def _edges(found: Found) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lowest and highest gain [dB] and half width of the phase [deg] of the 95 % circle."""
    size = np.abs(found.measured)
    if found.radius is None:
        none = np.full(size.size, np.nan)
        return none, none, none
    share = np.minimum(found.radius / np.maximum(size, 1e-300), 1.0)
    spread = np.where(share < 1, np.degrees(np.arcsin(share)), 180.0)
    return gain_db(np.maximum(size - found.radius, 0.0)), gain_db(size + found.radius), spread


def columns(found: Found) -> dict[str, np.ndarray]:
    """Columns [k] by the keys of metrics.json."""
    low, high, _ = _edges(found)
    return {
        "f_hz": found.f,
        "gain_db": gain_db(found.measured),
        "gain_low_db": low,
        "gain_high_db": high,
        "phase_deg": phase_deg(found.measured),
        "coherence": np.full(found.f.size, np.nan) if found.coherence is None else found.coherence,
        "model_gain_db": gain_db(found.model),
        "model_phase_deg": _beside(found, found.model),
    }


def rows(found: Found) -> list[dict[str, Any]]:
    """The rows of metrics.json."""
    named = {"record": found.name, "input": found.pair[0], "output": found.pair[1]}
    table = columns(found)
    return [named | dict(zip(table, map(float, row), strict=True)) for row in zip(*table.values(), strict=True)]


def _inside(found: Found) -> int | None:
    """Lines at which the model is inside the 95 % circle."""
    if found.radius is None:
        return None
    with np.errstate(invalid="ignore"):
        return int(np.sum(np.abs(found.model - found.measured) <= found.radius))


def _furthest(found: Found) -> tuple[float, float] | None:
    """Largest difference of gain [dB] where the band is narrower than half of it, and its frequency [Hz]."""
    apart = np.abs(gain_db(found.model) - gain_db(found.measured))
    if found.radius is not None:
        apart[found.radius >= np.abs(found.measured) / 2] = np.nan
    if not np.isfinite(apart).any():
        return None
    worst = int(np.nanargmax(apart))
    return float(apart[worst]), float(found.f[worst])


def figure(found: Found) -> Figure:
    """Gain and phase with the 95 % band, the model and its linear views; coherence where there is one."""
    low, high, spread = _edges(found)
    phase = phase_deg(found.measured)
    floor = np.nanmin(np.concatenate((gain_db(found.measured), gain_db(found.model)))) - 20
    wide = (np.where(np.isfinite(low), low, floor), high)  # a circle that holds the origin has no lower edge
    banded = found.radius is not None
    others = {"model": found.model, **found.linear}
    gain, turn = (
        [Curve("measured", found.f, gain_db(found.measured), "markers", band=wide if banded else None)],
        [Curve("measured", found.f, phase, "markers", band=(phase - spread, phase + spread) if banded else None)],
    )
    for name, response in others.items():
        style = "dash" if name in found.linear else "line"
        gain.append(Curve(name, found.f, gain_db(response), style))
        turn.append(Curve(name, found.f, _beside(found, response), style))
    below, above = (SIGNALS[name].unit for name in found.pair)
    unit = above if below == "1" else f"{above}/{below}"
    panels = [Panel(f"gain re 1 {unit} [dB]", gain), Panel("phase [deg]", turn, y_step=45.0)]
    if found.coherence is not None:
        panels.append(
            Panel("coherence [1]", [Curve("measured", found.f, found.coherence, "markers")], y_range=(0, 1.05))
        )
    note = "; ".join(filter(None, ("shaded: 95 % band" if banded else "", *found.notes)))
    title = f"{found.name}: {found.pair[1]} over {found.pair[0]}"
    return Figure(title, "frequency [Hz]", panels, log_x=True, note=note)


def page(source: str, rig: str, found: Sequence[Found]) -> Page:
    """The report."""
    lines = []
    for one in found:
        apart, where = _furthest(one) or (None, None)
        lines.append([one.name, one.f.size, _inside(one), apart, where, one.how])
    summary = Table(
        "Measured against model",
        ["record", "frequencies", "model inside the band", "largest difference [dB]", "at [Hz]", "measured by"],
        lines,
        note="The model is driven by the recorded command and goes through the same estimator as the record.",
    )
    below, above = found[0].pair
    sections = [Section("Summary", [summary]), Section("Bode", [figure(one) for one in found])]
    return Page(f"{above} over {below}: {source} and {rig}", _verdict(rig, found), sections)


def _verdict(rig: str, found: Sequence[Found]) -> str:
    parts = []
    for one in found:
        far = _furthest(one)
        if far is None:
            parts.append(f"{one.name}: the model of {rig} fails")
            continue
        inside = "" if one.radius is None else f"inside the 95 % band at {_inside(one)} of {one.f.size} frequencies, "
        parts.append(f"{one.name}: the model is {inside}furthest off by {far[0]:.2g} dB at {far[1]:.3g} Hz")
    return "; ".join(parts) + "."
