"""Several rigs at once: each watched, and one table of what needs attention first."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.process_pool import Jobs, process_pool
from ...base.words import agreed, counted
from ...records.campaign import FILE
from ...records.dated_sessions import dated_sessions
from ...report import Curve, Figure, Page, Panel, Section
from ..common.metric_table import MetricView
from ..common.outcome import Outcome, Progress, Stage, no_checkpoint
from ..common.step_experiment import StepConfig
from .page import standing, verdict
from .retuning import Retuning
from .study import run_watch, watched_rig

Row = Mapping[str, Any]


def rig_folders(folder: Path) -> list[Path]:
    """The rigs of a folder that has one sub-folder a rig, each with sessions; none where it is a rig's own."""
    if not folder.is_dir() or (folder / FILE).exists() or any(folder.glob(f"*/{FILE}")):
        return []
    return sorted({path.parents[1] for path in folder.glob(f"*/*/{FILE}")})


def run_watches(
    folders: Sequence[Path],
    rig: str | None,
    loop: StepConfig,
    a_year: float,
    retuning: Retuning | None,
    stage: Stage,
    progress: Progress,
    jobs: Jobs = 1,
) -> Outcome:
    """`rigs`: what a watch of each says, by name, those with an alarm first. A rig that cannot be read is one line."""

    def done(row: Row) -> None:
        progress(f"{row['name']}: {row['said']}")

    with process_pool(jobs, partial(partial, _watched, rig=rig, loop=loop, a_year=a_year, retuning=retuning)) as work:
        rows = work({folder.name: folder for folder in folders}, stage, done)
    rows = sorted(rows, key=_attention)
    metrics = {"rigs": rows, "alarms": [alarm for row in rows for alarm in row["alarms"]]}
    return Outcome(metrics, lambda: _page(rows))


def _watched(
    folder: Path, rig: str | None, loop: StepConfig, a_year: float, retuning: Retuning | None
) -> dict[str, Any]:
    try:
        found = dated_sessions(folder)
        own = watched_rig(found, rig)
        metrics = run_watch(found, own, loop, a_year, retuning, no_checkpoint, lambda _: None).metrics
    except InputError as error:
        return {"name": folder.name, "said": f"not read: {error}", "alarms": [], "sessions": 0, "last": None,
                "margins": {}, "forecast": [], "left_out": [str(error)]}  # fmt: skip
    sessions = metrics["sessions"]
    last = sessions[-1]
    return {
        "name": folder.name,
        "said": verdict(metrics, last["date"]),
        "alarms": metrics["alarms"],
        "sessions": len(sessions),
        "last": last["date"],
        "margins": last["margins"],
        "forecast": metrics["forecast"],
        "left_out": metrics["left_out"],
    }


def _attention(row: Row) -> tuple[bool, str, float, str]:
    """Alarms first, those whose loop passes a limit soonest before others; then rigs of which nothing was read."""
    soonest = min((each["from"] for each in row["forecast"]), default="9999")
    margin = row["margins"].get("gain_margin_db")
    quiet = bool(row["sessions"]) and not standing(row["alarms"])
    return quiet, soonest, 1e9 if margin is None else margin, row["name"]


def _page(rows: Sequence[Row]) -> tuple[Page, Figure]:
    margins = [row["margins"].get("gain_margin_db") for row in rows]
    unknown: dict[str, Any] = {"gain_margin_db": None, "settling_s": None}
    lines = [{**unknown, **row, **row["margins"], "unread": len(row["left_out"])} for row in rows]
    heads = {"name": "rig", "said": "what its watch says", "last": "newest", "unread": "left out"}
    keys = ("name", "said", "gain_margin_db", "settling_s", "sessions", "last", "unread")
    alarmed = [row["name"] for row in rows if standing(row["alarms"])]
    said = f"{len(alarmed)} of {counted(len(rows), 'rig')} {agreed('need', len(alarmed))} attention"
    said += f": {', '.join(alarmed)}." if alarmed else "."
    unread = [row["name"] for row in rows if not row["sessions"]]
    said += f" Not read, so that nothing is known of them: {', '.join(unread)}." if unread else ""
    y = np.array([np.nan if margin is None else margin for margin in margins], dtype=float)
    points = Curve("newest session", np.arange(1.0, len(rows) + 1), y, "markers")
    figure = Figure("The loop on each rig", "rig, most urgent first", [Panel("gain margin [dB]", [points])])
    table = MetricView().table("", lines, keys, heads=heads)
    return Page("Watch of several rigs", said, [Section("Most urgent first", [table, figure])], picture=figure), figure
