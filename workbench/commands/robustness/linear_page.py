"""The linear loops in the report: a table a point, and how stability and Ms change over the stroke."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...report import Curve, Figure, Panel, Table

_Rows = list[dict[str, Any]]


def linear_items(rows: _Rows) -> list[Table | Figure]:
    """What the rows of metrics.json's `linear` say."""
    points = dict.fromkeys(row["point"] for row in rows)
    return [linear_figure(rows), *(_table(point, [row for row in rows if row["point"] == point]) for point in points)]


def linear_figure(rows: _Rows) -> Figure:
    """Median and largest Ms over the position, the worse of null and moving; unstable plants where there are any."""
    rows = [row for row in rows if row["position"] is not None]
    panels = [
        Panel("Ms, median", _curves(rows, lambda row: row["ms_p50"]), y_range=_range(rows, "ms_p50", 5.0)),
        Panel("Ms, largest", _curves(rows, lambda row: row["ms_worst"]), y_range=_range(rows, "ms_worst", 10.0)),
    ]
    if any(row["unstable"] for row in rows):
        unstable = _curves(rows, lambda row: 100 * row["unstable"] / row["plants"])
        panels.insert(0, Panel("unstable [%]", unstable))
    return Figure("Over the position; a gap in Ms: unstable", "position from mid stroke [mm]", panels)


def _range(rows: _Rows, key: str, most: float) -> tuple[float, float]:
    """From 1 to a little above the largest value, but no further than `most`."""
    return 1.0, min(most, 1.1 * max((row[key] for row in rows if row[key] is not None), default=most))


def _curves(rows: _Rows, pick: Callable[[dict[str, Any]], float | None]) -> list[Curve]:
    positions = sorted({row["position"] for row in rows})
    curves = []
    for name in dict.fromkeys(row["controller"] for row in rows):
        own = [row for row in rows if row["controller"] == name]
        values = [[pick(row) for row in own if row["position"] == position] for position in positions]
        worst = [np.nan if None in points else max(filter(None, points), default=0.0) for points in values]
        curves.append(Curve(name, 1e3 * np.array(positions), np.array(worst)))
    return curves


def _table(point: str, rows: _Rows) -> Table:
    """A line a controller, a column a place: Ms, median and largest, or how many are unstable."""
    places = dict.fromkeys(row["position"] for row in rows)
    columns = ["where drawn" if place is None else f"{1e3 * place:+g} mm" for place in places]
    lines = [
        [name, *(_cell(row) for row in rows if row["controller"] == name)]
        for name in dict.fromkeys(row["controller"] for row in rows)
    ]
    return Table(f"Ms at {point}: median / largest of the plants", ["controller", *columns], lines)


def _cell(row: dict[str, Any]) -> str:
    median = "unstable" if row["ms_p50"] is None else f"{row['ms_p50']:.3g}"
    if row["unstable"]:
        return f"{median} / {row['unstable']} unstable"
    return f"{median} / {row['ms_worst']:.3g}"
