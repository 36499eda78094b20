"""The report on hidden rigs: what came out of each, beside a tuning that knows it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from workbench.base.words import counted
from workbench.report import Curve, Figure, Page, Panel, Section, Table

_WAYS = ("automatic", "datasheet", "found", "known")


def page(metrics: Mapping[str, Any]) -> tuple[Page, Figure]:
    """The report and its telling figure: settling by every way, rig by rig."""
    rows, whole = metrics["rows"], metrics["summary"]
    verdict = (
        f"{whole['commissioned']} of {whole['rigs']} rigs were commissioned, with {counted(whole['trips'], 'trip')} "
        f"and {counted(whole['wrong_names'], 'wrong name')}. 10 mm settles within 1.15 times of what tuning with the "
        f"truth known reaches on {whole['within_1.15_of_known']}, and is predicted within 15 % on "
        f"{whole['predicted_within_15_percent']}."
    )
    numbers = np.arange(len(rows), dtype=float)
    curves = [Curve(way, numbers, _settling(rows, way), style="points") for way in _WAYS]
    figure = Figure("10 mm, measured on the rig", "rig", [Panel("settling [s]", curves, log_y=True)])
    heads = ["rig", "truth", "trap", "said", *(f"{way} [s]" for way in _WAYS), "kept", "predicted [s]", "rig time [s]"]
    heads += ["trips"]
    lines = [
        [
            row["id"],
            " + ".join(row["truth"]),
            row["trap"],
            row["error"] or f"{row['verdict']}: {', '.join(row['said'])}",
            *(row["settling_s"].get(way) for way in _WAYS),
            row["kept"],
            row["predicted_s"].get(row["kept"]),
            row["rig_seconds"],
            row["trips"],
        ]
        for row in rows
    ]
    sections = [Section("Rigs", [figure, Table("", heads, lines, "known: the same search on the rig as it is.")])]
    return Page("Commissioning of hidden rigs", verdict, sections), figure


def _settling(rows: Sequence[Mapping[str, Any]], way: str) -> np.ndarray:
    """What the goal settles in [s] on every rig [n]; NaN where it does not."""
    return np.array([row["settling_s"].get(way) for row in rows], dtype=float)
