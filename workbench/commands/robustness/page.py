"""The report of a robustness experiment: a table of controllers, settling and sensitivity over the drawn plants."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...base.units import from_si
from ...base.words import counted
from ...loop.rows import moving_at
from ...report import Curve, Figure, Page, Panel, Section, Table
from ..common.fitted_plant import with_fit
from ..common.judged import judged_words
from ..common.metric_table import MetricView
from ..common.plant_ranges import ranges_table
from ..common.time_figure import share_figure
from .options import RobustnessConfig

_COLUMNS = (
    *("controller", "unstable", "tripped", "hunting", "settling_p50_s", "settling_p99_s", "settling_worst_s"),
    *("times_limit", "overshoot_worst_percent", "ms_worst", "held_unstable", "held_ms_worst", "gain_margin_worst_db"),
    "cavitating",
)
_BAD = {"unstable": "unstable", "tripped": "tripped", "hunting": "hunting", "held_unstable": "unstable as measured"}
_OF_A_MEMORY = "held_unstable", "held_ms_worst"
_AS_MEASURED = "As measured: the loop that stands with what it has measured by the end of its steps, anywhere there. "
_BEST = ("settling_p50_s", "settling_p99_s", "settling_worst_s", "overshoot_worst_percent", "ms_worst")
_Rows = list[dict[str, Any]]


def robustness_page(
    config: RobustnessConfig,
    metrics: Mapping[str, Any],
    lanes: Mapping[str, Mapping[str, np.ndarray]],
    draw: Mapping[str, np.ndarray],
) -> Page:
    """One table, the distributions, the worst plant of each controller, and what was drawn."""
    rows, unit = metrics["rows"], config.signal.unit
    remembers = any(row["held_ms_worst"] is not None or row["held_unstable"] for row in rows)
    columns = [key for key in _COLUMNS if remembers or key not in _OF_A_MEMORY]
    step, band = (float(from_si(size, unit, config.signal.si)) for size in (config.step, metrics["band"]))
    table = MetricView.of(config.rig, config.signal).table(
        f"A step of {step:g} {unit} on {counted(config.plants, 'plant')}",
        rows,
        columns,
        f"Counts of plants. Settled within {band:.3g} {unit}; a plant that never settles counts as the "
        "slowest, and a dash says that there is one. Unstable, Ms and margins: at null and moving at "
        f"{moving_at(config.signal, config.rig.passing_speed)}, where each plant was drawn and at "
        f"{counted(len(config.positions), 'position')}. {_AS_MEASURED if remembers else ''}"
        "The limit: the soonest that an optimiser settles the nominal rig, at mid stroke (jackbench limit). "
        f"{judged_words(config.conditions, config.rig)}",
        _BEST,
        heads={"times_limit": "settling, 99 %, times the limit [1]"},
    )
    items: list[Any] = [table]
    if metrics["left_out"]:
        items.append(f"Linear loops only, for these laws do not run in lanes: {', '.join(metrics['left_out'])}.")
    sections = [
        Section("Controllers", items),
        Section("Settling over the plants", [robustness_figure(lanes)]),
        Section("Linear loops over the stroke", linear_items(metrics["linear"])),
        Section("The worst plant of each controller", [_worst(rows)]),
        Section("What was drawn", [_drawn(config, draw)]),
    ]
    seed = {"seed": str(config.conditions.seed)}
    return with_fit(Page(f"Robustness on {config.rig.name}", _verdict(rows), sections, seed), config.rig)


def _verdict(rows: list[dict[str, Any]]) -> str:
    """Which controller settles on all plants and soonest; else which of those that settle fails on the fewest."""
    if not rows:
        return "No law of this experiment runs in lanes, so that no step was played: the linear loops are all there is."
    settling = [row for row in rows if row["settling_p99_s"] is not None]
    if not settling:
        return "No controller settles on 99 % of the plants within the time that is watched."
    sound = [row for row in settling if not row["failing"]]
    if not sound:
        least = min(settling, key=lambda row: row["failing"])
        some = f"{_answer(least)}, in all on {counted(least['failing'], 'plant')}"
        return f"No controller that settles holds on all plants; {some}{', the fewest of them' * (len(settling) > 1)}."
    best = min(sound, key=lambda row: row["settling_p99_s"])
    return f"{_answer(best)}, Ms {best['ms_worst']:.3g} at worst."


def _answer(row: dict[str, Any]) -> str:
    bad = ", ".join(f"{row[key]} {word}" for key, word in _BAD.items() if row[key])
    holds = f"{bad} of {row['plants']}" if bad else f"holds on all {row['plants']}"
    return f"{row['controller']}: {holds}, 99 % settled within {row['settling_p99_s']:.3g} s"


def robustness_figure(lanes: Mapping[str, Mapping[str, np.ndarray]]) -> Figure:
    """The share of the plants that have settled, over time."""
    settling = {name: columns["settling_s"] for name, columns in lanes.items()}
    return settled_figure("Share of the plants that have settled", settling)


def settled_figure(title: str, settling: Mapping[str, np.ndarray]) -> Figure:
    """The share of plants that have settled, of settling times [plants] s by name; NaN of one that never does."""
    return share_figure(title, settling, "time [s]", "settled [%]")


def _worst(rows: list[dict[str, Any]]) -> Table:
    names = list(rows[0]["worst"]) if rows else []
    return Table(
        "", ["controller", *names], [[row["controller"], *(row["worst"][name] for name in names)] for row in rows]
    )


def _drawn(config: RobustnessConfig, draw: Mapping[str, np.ndarray]) -> Table:
    delays = [config.conditions.delay(spec, config.rig) for spec in config.controllers]
    return ranges_table(draw, ["computing delay", min(delays), max(delays), "s"])


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
