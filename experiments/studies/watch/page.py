"""The page of a study of watches: each made rig, alarms of healthy years, and how often forecasts hold."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from workbench.report import Curve, Figure, Page, Panel, Section, Table


def page(metrics: Mapping[str, Any]) -> tuple[Page, Figure]:
    """The table and what it comes to."""
    whole = metrics["summary"]
    said = (
        f"{whole['told']} of {whole['worn']} wears are told, {whole['right']} by their name or among what looks alike; "
        f"{whole['before_hurt']} before the loop lost 1 dB. {whole['wrong']} rigs have a wrong name. "
        f"{whole['false_alarms']} of {whole['healthy']} healthy rigs have an alarm."
    )
    heads = ["rig", "wear", "growth", "begins", "told", "mended", "gone", "names", "share then", "lost [dB]"]
    heads += ["hurt at", "CPU [s]"]
    keys = ("id", "wear", "growth", "begins", "told", "mended", "gone", "alarms", "share", "lost_db")
    keys += ("hurt", "cpu_s")
    lines = [[names(row[key]) if key == "alarms" else row[key] for key in keys] for row in metrics["rows"]]
    curves = [Curve(row["id"], np.arange(float(len(row["chi2"]))), np.array(row["chi2"])) for row in metrics["rows"]]
    figure = Figure("What the rig as it was leaves", "session", [Panel("chi2 [1]", curves, log_y=True)])
    rest = [_healthy(metrics["healthy"])] if metrics["healthy"] else []
    sections = [Section("Rigs", [Table("", heads, lines), figure]), Section("Rates", [*rest, _forecasts(metrics)])]
    return Page("Watches of made rigs", said, sections), figure


def names(alarms: Sequence[Mapping[str, Any]]) -> str:
    """What the alarms of a rig name."""
    return ", ".join(" or ".join(alarm["among"]) if alarm["effect"] else "unknown" for alarm in alarms)


def _healthy(healthy: Mapping[str, Any]) -> Table:
    lines = [
        [words, healthy["years"], healthy[name]["alarms"], healthy["asked_a_year"], *healthy[name]["a_year"]]
        for name, words in {"resampled": "as the sessions do, in blocks", "other_laws": "by other laws"}.items()
    ]
    heads = ["numbers wander", "years", "alarms", "asked for [1/year]", "a year [1]", "low", "high"]
    return Table("Alarms of healthy years, drawn", heads, lines, "Low and high: 95 %.")


def _forecasts(metrics: Mapping[str, Any]) -> Table:
    lines = [[pace, each["forecasts"], each["held"]] for pace, each in metrics["forecasts"].items()]
    note = "Wears are drawn whose growth is steady, unsteady from week to week, or faster and faster."
    return Table("Forecasts whose 80 % interval holds the true day", ["pace", "forecasts", "share [1]"], lines, note)
