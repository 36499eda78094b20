"""A Figure as the JSON that plotly.js draws."""

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .figures import Curve, Figure, Mark, Panel
from .palette import GRID, GRID_FINE, INK, INK_SOFT, RULE, Look
from .thin import drawn_points, window_points

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
_GAP = 28  # px between stacked panels
_MARGIN = {"t": 34, "b": 50, "l": 64, "r": 14}  # the tool bar lives in the top margin, off the data


def chart(figure: Figure, look: Mapping[str, Look]) -> dict[str, Any]:
    """{"data", "layout", "steps"} for plotly.js: no NaN, long curves thinned; "steps": y_step by axis."""
    axes = [f"y{index + 1}" if index else "y" for index in range(len(figure.panels))]
    data = [
        trace
        for axis, panel in zip(axes, figure.panels, strict=True)
        for curve in panel.curves
        for trace in _traces(curve, axis, _unit(panel.y_label), look[curve.name], figure.x_range)
    ]
    names = [escape(name, quote=False) for name in figure.x_names]
    for trace in data if names else ():
        trace["x"] = [None if place is None else names[round(place) - 1] for place in trace["x"]]
    steps = {_long(axis): panel.y_step for axis, panel in zip(axes, figure.panels, strict=True) if panel.y_step}
    return {"data": data, "layout": _layout(figure, axes), "steps": steps}


def is_thinned(figure: Figure) -> bool:
    """Whether any curve is too long to be drawn whole."""
    curves = [curve for panel in figure.panels for curve in panel.curves]
    return any(len(curve.x) > len(window_points(curve.x, curve.y, figure.x_range)) for curve in curves)


def height(figure: Figure) -> int:
    """Height in CSS pixels."""
    if figure.height is not None:
        return figure.height
    count = len(figure.panels)
    each = 270 if count == 1 else 205 if count == 2 else 165
    return count * each + (count - 1) * _GAP + _MARGIN["t"] + _MARGIN["b"]


def numbers(values: NDArray[np.float64], digits: int) -> list[float | int | None]:
    """Values with `digits` significant digits, as short as JSON allows; None for what is not finite."""
    short = [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values.tolist()]
    return [int(v) if v is not None and v.is_integer() and abs(v) < 1e15 else v for v in short]


def segments(finite: NDArray[np.bool_]) -> list[slice]:
    """The unbroken stretches of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], finite.astype(int), [0]))))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def rgba(colour: str, alpha: float) -> str:
    """ "#rrggbb" with an opacity."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha})"


def _traces(
    curve: Curve, axis: str, unit: str, look: Look, window: tuple[float, float] | None
) -> Iterator[dict[str, Any]]:
    shared = {"type": "scatter", "yaxis": axis, "legendgroup": curve.name, "visible": curve.visible}
    if curve.band is not None:
        yield shared | _band(curve, look.colour)
    keep = window_points(curve.x, curve.y, window)
    style = look.style(curve.style)
    dash = {"dash": style} if style in ("dash", "dot") else {}
    pen = {"mode": "lines", "line": {"color": look.colour, "width": 1.6, "simplify": False} | dash}
    if style == "markers":
        pen = {"mode": "markers", "marker": {"color": look.colour, "size": 6}}
    if style == "points":
        pen |= {"mode": "lines+markers", "marker": {"color": look.colour, "size": 4.5}}
    yield (
        shared
        | pen
        | {
            "name": escape(curve.name, quote=False),
            "x": numbers(curve.x[keep], 7),
            "y": numbers(curve.y[keep], 6),
            "hovertemplate": "%{y:.4~g}" + escape(f" {unit}" if unit else "", quote=False),
        }
    )


def _band(curve: Curve, colour: str) -> dict[str, Any]:
    """The band as closed outlines, one a stretch without gaps: fills between two broken lines would bridge the gaps."""
    assert curve.band is not None
    keep = np.union1d(drawn_points(curve.band[0]), drawn_points(curve.band[1]))
    x, low, high = curve.x[keep], curve.band[0][keep], curve.band[1][keep]
    outline_x, outline_y = [np.empty(0)], [np.empty(0)]
    for part in segments(np.isfinite(x) & np.isfinite(low) & np.isfinite(high)):
        outline_x += [x[part], x[part][::-1], np.array([np.nan])]
        outline_y += [low[part], high[part][::-1], np.array([np.nan])]
    return {
        "mode": "lines",
        "line": {"width": 0},
        "fill": "toself",
        "fillcolor": rgba(colour, 0.16),
        "hoverinfo": "skip",
        "x": numbers(np.concatenate(outline_x), 7),
        "y": numbers(np.concatenate(outline_y), 6),
    }


def _layout(figure: Figure, axes: list[str]) -> dict[str, Any]:
    layout: dict[str, Any] = {
        "height": height(figure),
        "margin": _MARGIN,
        "font": {"family": FONT, "size": 12, "color": INK},
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "showlegend": False,  # the page has its own, which never covers data
        "hovermode": "x unified",
        "hoversubplots": "axis",
        "hoverlabel": {"bgcolor": "rgba(255,255,255,0.94)", "bordercolor": RULE, "font": {"size": 12, "color": INK}},
        "dragmode": "zoom",
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": RULE, "activecolor": INK_SOFT},
        "xaxis": _x_axis(figure, axes[-1]),
        "shapes": [
            _shape(mark, axis)
            for axis, panel in zip(axes, figure.panels, strict=True)
            for mark in panel.marks
            if np.isfinite(mark.value)
        ],
    }
    inside = height(figure) - _MARGIN["t"] - _MARGIN["b"]
    gap = _GAP / inside
    each = (1 - gap * (len(axes) - 1)) / len(axes)
    for index, (axis, panel) in enumerate(zip(axes, figure.panels, strict=True)):
        top = 1 - index * (each + gap)
        layout[_long(axis)] = _y_axis(panel) | {"domain": [max(round(top - each, 5), 0), round(top, 5)]}
    return layout


def _axis(label: str, log: bool) -> dict[str, Any]:
    fine = {"minor": {"showgrid": True, "gridcolor": GRID_FINE, "dtick": "D1"}} if log else {}
    return fine | {
        "type": "log" if log else "linear",
        "title": {"text": escape(label, quote=False), "standoff": 8, "font": {"size": 12, "color": INK_SOFT}},
        "showline": True,
        "linecolor": RULE,
        "mirror": "all",  # a frame around every panel
        "gridcolor": GRID,
        "zeroline": False,
        "ticks": "",  # the grid shows where a label belongs
        "ticklabelstandoff": 4,
        "tickfont": {"color": INK_SOFT},
        "automargin": True,
        "exponentformat": "power",
    }


def _x_axis(figure: Figure, lowest: str) -> dict[str, Any]:
    spike = {"showspikes": True, "spikemode": "across", "spikethickness": 1, "spikecolor": RULE, "spikedash": "solid"}
    name = escape(figure.x_label.split("[")[0].strip(), quote=False)
    title = f"{name} %{{x:.6~g}} {escape(_unit(figure.x_label), quote=False)}".strip()
    named: dict[str, Any] = {}
    if figure.x_names:
        title, ends = "%{x}", [-0.5, len(figure.x_names) - 0.5]
        named = {
            "type": "category",
            "categoryarray": [escape(name, quote=False) for name in figure.x_names],
            "categoryorder": "array",
            "range": ends,
        }
    if figure.x_range is not None:
        named["range"] = numbers(np.log10(figure.x_range) if figure.log_x else np.asarray(figure.x_range), 7)
    axis = _axis(figure.x_label, figure.log_x) | spike | named
    return axis | {"anchor": lowest, "unifiedhovertitle": {"text": title}}


def _y_axis(panel: Panel) -> dict[str, Any]:
    axis = _axis(panel.y_label, panel.log_y) | {"anchor": "x"}
    if panel.y_range is not None:
        ends = np.asarray(panel.y_range, dtype=float)
        axis["range"] = numbers(np.log10(ends) if panel.log_y else ends, 7)
    return axis


def _shape(mark: Mark, axis: str) -> dict[str, Any]:
    across, along = ("y", "x") if mark.axis == "y" else ("x", "y")
    where = {f"{across}0": mark.value, f"{across}1": mark.value, f"{along}0": 0, f"{along}1": 1}
    refs = {"xref": "x domain", "yref": axis} if mark.axis == "y" else {"xref": "x", "yref": f"{axis} domain"}
    label = {"text": escape(mark.label, quote=False), "font": {"size": 11, "color": INK_SOFT}, "padding": 2}
    place = (
        {"textposition": "end", "yanchor": "bottom"} if mark.axis == "y" else {"textposition": "end", "textangle": 0}
    )
    line = {"color": INK_SOFT, "width": 1, "dash": "6px,4px"}
    return {"type": "line", **where, **refs, "line": line, "label": label | place, "layer": "above"}


def _unit(label: str) -> str:
    """ "dB" of "gain [dB]"; nothing for a dimensionless or bare label."""
    unit = label.rpartition("[")[2].rstrip("]") if label.endswith("]") else ""
    return "" if unit in ("1", "-") else unit


def _long(axis: str) -> str:
    return "yaxis" + axis[1:]
