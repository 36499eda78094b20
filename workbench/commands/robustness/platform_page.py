"""The report of a platform's robustness: tables of controllers, and how soon the drawn platforms settle."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...base.signals import output_signal
from ...base.units import from_si
from ...base.words import counted
from ...report import Figure, Page, Section, Table
from ...rigs.platform import AXES
from ..common.metric_table import MetricView
from .options import PlatformRobustness
from .page import settled_figure

Metrics = Mapping[str, Any]
_COLUMNS = (
    *("scenario", "controller", "tripped", "hunting", "never", "failing_least_kg", "failing_most_kg", "settling_p50_s"),
    *("settling_p99_s", "settling_worst_s", "overshoot_worst_percent", "cross_worst_percent", "cavitating"),
)
_LINEAR = (
    *("controller", "unstable", "unstable_least_kg", "unstable_most_kg", "ms_median", "ms_worst"),
    *("coupling_median_percent", "coupling_worst_percent"),
)


def platform_page(
    config: PlatformRobustness, metrics: Metrics, columns: Mapping[str, np.ndarray], drawn: Mapping[str, np.ndarray]
) -> tuple[Page, Figure]:
    """The report and its telling figure."""
    figures = [
        settled_figure(
            f"{step.name}: share of the platforms that have settled",
            {spec.name: columns[f"{spec.name}.{step.name}.settling"] for spec in config.controllers},
        )
        for step in config.steps
    ]
    rows = metrics["rows"]
    judged = "ideal sensors and no delay" if config.conditions.ideal else "with noise, resolution and computing delay"
    steps = MetricView().table(
        f"Steps on {counted(config.plants, 'platform')}",
        rows,
        _COLUMNS,
        f"Counts of platforms, {judged}. Settled within 2 % of the step; a platform that never settles counts as the "
        "slowest, and a dash says that there is one. Hunting: swings without noise "
        "that do not die away, along any axis. Other axes: how far any of them goes, in percent of the step, "
        "angles times the radius of the joints. Cavitating: gas comes out of the oil in a chamber.",
    )
    linear = MetricView().table(
        "Linear loops, each at its own pose",
        metrics["linear"],
        _LINEAR,
        "Ms is the largest singular value of the sensitivity at the six commands.",
    )
    ranges = Table(
        "Payloads and poses that were drawn, uniformly",
        ["number", "least", "largest", "unit"],
        [[name, _shown(name, values.min())[0], *_shown(name, values.max())] for name, values in drawn.items()],
        "The moments of inertia go with the mass. Each leg has numbers of its own, within the bounds of its rig and "
        "the factors of [within].",
    )
    sections = [
        Section("Controllers", [steps, linear]),
        Section("Settling over the platforms", figures),
        Section("The slowest platform of each", [_worst(rows)]),
        Section("What was drawn", [ranges]),
    ]
    return Page(f"Robustness of {config.rig.name}", _verdict(metrics), sections), figures[0]


def _verdict(metrics: Metrics) -> str:
    """On how many platforms each controller fails, and which of those that hold settles soonest."""
    told = {row["controller"]: row["failing"] for row in metrics["linear"]}
    sound = [name for name, bad in told.items() if not bad]
    if not sound:
        least = min(told, key=lambda name: told[name])
        return f"No controller holds on all platforms; {least} fails on the fewest, on {told[least]}."
    slowest = {
        name: max(row["settling_p99_s"] for row in metrics["rows"] if row["controller"] == name) for name in sound
    }
    best = min(slowest, key=lambda name: slowest[name])
    return f"{best} holds on all platforms; in each step 99 % of them settle within {slowest[best]:.3g} s."


def _worst(rows: list[dict[str, Any]]) -> Table:
    names = list(rows[0]["worst"])
    heads = [f"{name} [{_shown(name, 0.0)[1]}]" for name in names]
    lines = [
        [row["scenario"], row["controller"], *(_shown(name, row["worst"][name])[0] for name in names)] for row in rows
    ]
    return Table("", ["step", "controller", *heads], lines)


def _shown(name: str, value: float) -> tuple[float, str]:
    """A number of payload or pose as it is read, and its unit."""
    signal = output_signal(name) if name in AXES else None
    unit, si = (signal.unit, signal.si) if signal else ("kg", "kg") if name == "mass" else ("mm", "m")
    return float(from_si(value, unit, si)), unit
