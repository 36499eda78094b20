"""The report of automatic tuning runs: the rig set, then what a report of robustness says of the drawn plants."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...report import Page, Section
from ..common.judged import judged_words
from ..common.metric_table import MetricView
from ..robustness.page import robustness_page
from .automatic_config import AutomaticConfig

_KEYS = (
    "scenario", "rig", "gain", "pressure_gain", "settling_s", "overshoot_percent", "residual_oscillation", "stable",
    "ms", "gain_margin_db", "tripped",
)  # fmt: skip


def automatic_page(
    config: AutomaticConfig,
    metrics: Mapping[str, Any],
    lanes: Mapping[str, Mapping[str, np.ndarray]],
    draw: Mapping[str, np.ndarray],
) -> Page:
    """Every rig with its own gains, then the plants."""
    maker = MetricView.of(config.rig, config.drawn.signal, config.scenarios)
    note = (
        "Gains by rules, from small moves of each rig: of P [1/m] and of the pressure feedback [1/Pa]. "
        f"{judged_words(config.drawn.conditions, config.rig)}"
    )
    first = Section("The rig set", [maker.table("Each tuned by itself", metrics["rows"], _KEYS, note)])
    page = robustness_page(config.drawn, {**metrics, "rows": metrics["drawn"]}, lanes, draw)
    return replace(page, title=f"Automatic tuning of {config.rig.name}", sections=[first, *page.sections])
