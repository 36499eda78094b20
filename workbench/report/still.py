"""The same figure as a still picture, for a README: drawn with matplotlib, without its global state."""

from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, MultipleLocator, NullFormatter, StrMethodFormatter

from .chart import height, segments
from .figures import Curve, Figure, Mark, Panel
from .palette import GRID, GRID_FINE, INK, INK_SOFT, RULE, Look, looks

_DASHES = {"line": "-", "dash": (0, (5, 2.5)), "dot": (0, (1.2, 1.8)), "markers": "none", "points": "-"}
_MARKERS = {"markers": 4, "points": 3}
_WIDTH, _DPI = 860, 160
_STYLE: dict[Any, object] = {
    "font.family": "sans-serif",
    "font.size": 9,
    "text.color": INK,
    "svg.hashsalt": "jackbench",  # the ids of a drawing would differ in every run
    "svg.fonttype": "path",
}


def still_picture(figure: Figure, path: Path, look: Mapping[str, Look] | None = None) -> None:
    """Draw `figure`, all its samples, into `path`, .png or .svg.

    look: page_looks of the page that has the figure too, else chosen for this figure alone.

    Raises ValueError for another suffix. The same figure gives the same file.
    """
    if path.suffix not in (".png", ".svg"):
        raise ValueError(f"{path}: a still picture is a .png or an .svg")
    _save(figure, path, path.suffix[1:], look)


def svg_text(figure: Figure) -> str:
    """The text of the .svg file of a figure."""
    text = StringIO()
    _save(figure, text, "svg", None)
    return text.getvalue()


def pixels(figure: Figure) -> np.ndarray:
    """The figure as red, green and blue [height, width, 3], uint8."""
    with mpl.rc_context(_STYLE):
        canvas = FigureCanvasAgg(_draw(figure, looks([figure])))
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _save(figure: Figure, target: Path | StringIO, kind: str, look: Mapping[str, Look] | None) -> None:
    with mpl.rc_context(_STYLE):
        canvas = _draw(figure, look or looks([figure]))
        FigureCanvasAgg(canvas)
        plain = {"Software": None} if kind == "png" else {"Date": None, "Creator": None}
        canvas.savefig(target, format=kind, dpi=_DPI, metadata=plain)


def _draw(figure: Figure, look: Mapping[str, Look]) -> Canvas:
    canvas = Canvas(figsize=(_WIDTH / 100, (height(figure) + 60) / 100), layout="constrained", facecolor="white")
    grid = canvas.subplots(len(figure.panels), 1, sharex=True, squeeze=False)
    axes: list[Axes] = [row[0] for row in grid]
    for ax, panel in zip(axes, figure.panels, strict=True):
        _draw_panel(ax, panel, figure, look)
    axes[-1].set_xlabel(figure.x_label, color=INK_SOFT)
    canvas.suptitle(figure.title, fontsize=11, fontweight="bold", x=0.01, ha="left")
    canvas.align_ylabels(axes)
    keys = _keys(figure, look)
    if keys:
        canvas.legend(handles=keys, loc="outside lower left", ncols=min(len(keys), 4), frameon=False)
    return canvas


def _draw_panel(ax: Axes, panel: Panel, figure: Figure, look: Mapping[str, Look]) -> None:
    _dress(ax, panel, figure)
    shown = [curve for curve in panel.curves if curve.visible]
    for curve in shown:
        _draw_curve(ax, curve, look[curve.name])
    ax.margins(x=0.02 if any(curve.style == "markers" for curve in shown) else 0)
    if panel.y_range is not None:
        ax.set_ylim(*panel.y_range)
    if figure.log_x:
        _label_log(ax)
    if figure.x_range is not None:
        ax.set_xlim(*figure.x_range)
    if figure.x_names:
        ax.set_xticks(range(1, len(figure.x_names) + 1), figure.x_names, rotation=30 if len(figure.x_names) > 8 else 0)
        ax.set_xlim(0.5, len(figure.x_names) + 0.5)
    low, high = ax.get_ylim()
    for mark in panel.marks:
        if np.isfinite(mark.value):
            _draw_mark(ax, mark)
    if all(low <= mark.value <= high for mark in panel.marks if mark.axis == "y"):
        ax.set_ylim(low, high)
    if panel.y_step and high - low > 1.5 * panel.y_step:
        times = next((n for n in (1, 2, 4, 8) if (high - low) / (n * panel.y_step) <= 7), 16)
        ax.yaxis.set_major_locator(MultipleLocator(times * panel.y_step))


def _dress(ax: Axes, panel: Panel, figure: Figure) -> None:
    ax.set_ylabel(panel.y_label, color=INK_SOFT)
    ax.set_xscale("log" if figure.log_x else "linear")
    ax.set_yscale("log" if panel.log_y else "linear")
    if not panel.log_y:
        ax.yaxis.set_major_locator(MaxNLocator(6))
    ax.grid(color=GRID, linewidth=0.7)
    ax.grid(which="minor", color=GRID_FINE, linewidth=0.6)
    ax.set_axisbelow(True)
    ax.tick_params(which="both", color=RULE, labelcolor=INK_SOFT)
    for spine in ax.spines.values():
        spine.set_color(RULE)


def _label_log(ax: Axes) -> None:
    """1, 2, 5, 10 written out where there are few decades; powers of ten otherwise."""
    low, high = ax.get_xlim()
    if high <= 1e4 * low:
        ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())


def _draw_curve(ax: Axes, curve: Curve, look: Look) -> None:
    style = look.style(curve.style)
    if curve.band is not None:
        low, high = curve.band
        for part in segments(np.isfinite(curve.x) & np.isfinite(low) & np.isfinite(high)):
            ax.fill_between(curve.x[part], low[part], high[part], color=look.colour, alpha=0.16, linewidth=0)
    y = np.where(np.isfinite(curve.y), curve.y, np.nan)
    size = _MARKERS.get(style, 0)
    marker = "o" if size else None
    ax.plot(curve.x, y, color=look.colour, linewidth=1.3, linestyle=_DASHES[style], marker=marker, markersize=size)


def _draw_mark(ax: Axes, mark: Mark) -> None:
    line = {"color": INK_SOFT, "linewidth": 0.8, "linestyle": (0, (6, 4)), "zorder": 1.5}
    text = {"color": INK_SOFT, "fontsize": 8, "textcoords": "offset points", "clip_on": True}
    if mark.axis == "y":
        ax.axhline(mark.value, **line)
        ax.annotate(mark.label, (1, mark.value), (-3, 2), xycoords=("axes fraction", "data"), ha="right", **text)
    else:
        ax.axvline(mark.value, **line)
        ax.annotate(mark.label, (mark.value, 1), (3, -10), xycoords=("data", "axes fraction"), **text)


def _keys(figure: Figure, look: Mapping[str, Look]) -> list[Line2D]:
    first: dict[str, Curve] = {}
    for panel in figure.panels:
        for curve in panel.curves:
            if curve.visible:
                first.setdefault(curve.name, curve)
    return [_key(name, look[name], curve) for name, curve in first.items()]


def _key(name: str, look: Look, curve: Curve) -> Line2D:
    style = look.style(curve.style)
    size = _MARKERS.get(style, 0)
    marker = "o" if size else None
    return Line2D(
        [], [], label=name, color=look.colour, linewidth=1.6, linestyle=_DASHES[style], marker=marker, markersize=size
    )
