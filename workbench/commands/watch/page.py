"""The page that is looked at every week: what changes, every number and effect over time, and the loop below them."""

from collections.abc import Mapping, Sequence
from datetime import date
from typing import Any

import numpy as np

from ...base.words import counted, listed
from ...identify.watch.history import FEWEST, History
from ...identify.watch.known_then import NORMAL
from ...identify.watch.loop_costs import FIGURES
from ...identify.watch.told import NamedChange
from ...loop.metrics import METRICS
from ...records.dated_sessions import DatedSession
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...report.figures import Mark
from ..common.metric_table import MetricView

_LOOP_NOTE = (
    "The error of a sine is that of 2 mm at 5 Hz, RMS over RMS. The worst margin is the least gain margin over the "
    "stroke and over the intervals of the session's numbers."
)
_ROW = 4  # panels of a figure


def watch_page(
    name: str,
    known: History,
    sessions: Sequence[DatedSession],
    seen: np.ndarray,
    told: Sequence[NamedChange],
    costs: Mapping[str, Sequence[float | None]],
    metrics: Mapping[str, Any],
    shown: MetricView,
) -> tuple[Page, Figure]:
    """The page and its telling figure: the axes that changed, with the loop's figures below; `seen`: value, low and
    high [3, T, n] of each axis, NaN where it is not told; `shown`: how rows of the loop are."""
    weeks = known.days / 7.0
    marks = tuple(Mark(week, session.remark or "repair", "x")
                  for week, session in zip(weeks, sessions, strict=True) if session.repair)  # fmt: skip
    marks += tuple(Mark(float(weeks[each.first_alarm]), "alarm", "x") for each in told)
    ends = [each.change.end for each in told if each.change.end is not None]
    marks += tuple(Mark(float(weeks[end]), "gone", "x") for end in ends)
    first = sorted(range(len(known.axes)), key=lambda k: -_wanders(seen[:, :, k]))[:2]
    begun = f"weeks since {sessions[0].day} [1]"
    panels = [_course(each, weeks, marks) for each in told if each.course] or [
        _panel(known, weeks, seen, k, marks) for k in first
    ]
    loop = [Panel(shown.head(key), [Curve(metrics["controller"], weeks, _values(costs[key]), "points")], marks=marks)
            for key in FIGURES if np.isfinite(_values(costs[key])).any()]  # fmt: skip
    title = "What changes" if told else "What wanders most, as a healthy rig does"
    picture = Figure(f"{title}, and the loop on the rig as it is", begun, [*panels, *loop[:3]])
    every = [_panel(known, weeks, seen, k, marks) for k in range(len(known.axes)) if _wanders(seen[:, :, k]) >= 0]
    sections = [
        Section(
            "Alarms",
            [
                _alarms(metrics["alarms"]),
                *_healthy(metrics),
                *_forecast(metrics),
                *_left_out(metrics["left_out"]),
            ],
        ),
        Section(
            "The loop",
            [
                *_retuning(metrics, shown),
                *(
                    [Figure(f"{metrics['controller']} on the rig of each session", begun, loop), _LOOP_NOTE]
                    if loop
                    else [f"{metrics['controller']} does not hold the rig of any session."]
                ),
            ],
        ),
        Section(
            "Every number and effect",
            [
                Figure(f"Numbers and effects, {place // _ROW + 1}", begun, every[place : place + _ROW])
                for place in range(0, len(every), _ROW)
            ]
            + _not_told(known, seen),
        ),
        Section("The newest session", [_residuals(metrics["sessions"])]),
        Section("Sessions", [_sessions(sessions, metrics["sessions"])]),
    ]
    return Page(f"Watch of {name}", verdict(metrics, sessions[-1].day), sections, picture=picture), picture


def verdict(metrics: Mapping[str, Any], last: date) -> str:
    """What changes, since when, how fast; or that nothing does."""
    count = len(metrics["sessions"])
    if count < FEWEST:
        return (
            f"{counted(count, 'session')}: {FEWEST} are needed to know how this rig wanders, so no alarm is given yet."
        )
    if not metrics["alarms"]:
        return f"Nothing changes beyond a healthy wander over {counted(count, 'session')} until {last}."
    coming = [
        f"of {metrics['controller']} the {passing(row)} between {row['from']} and {row['to']}"
        for row in metrics["forecast"]
    ]
    said = [_sentence(alarm, metrics["sessions"]) for alarm in metrics["alarms"]]
    return ". ".join((*said, *(f"At this rate, with 80 %, {line}" for line in coming))) + "."


def passing(row: Mapping[str, Any]) -> str:
    """The limit that a forecast is about, in words."""
    of = METRICS[row["figure"]]
    return f"{of.name} passes {row['limit']:g}{'' if of.unit == '1' else f' {of.unit}'}"


def _sentence(alarm: Mapping[str, Any], sessions: Sequence[Mapping[str, Any]]) -> str:
    who, rate = _who(alarm), alarm["rate"]
    told = f"told on {alarm['told']}" + (f", and gone since {alarm['until']}" if alarm["until"] else "")
    if rate is None:
        return f"{who} changed since {alarm['since']}; {told}"
    drifts = "drifted by" if alarm["until"] else "drifts by"
    how = drifts if alarm["shape"] == "drift" else "changed at once by"
    size = f"{rate['value']:.3g} {rate['unit']} ({rate['low']:.3g} to {rate['high']:.3g})"
    return f"{who} {how} {size} since {alarm['since']}{_cost(alarm, sessions)}; {told}"


def _cost(alarm: Mapping[str, Any], sessions: Sequence[Mapping[str, Any]]) -> str:
    """What it has done to the loop while it was there."""
    during = [row for row in sessions if alarm["since_between"][0] <= row["date"] < (alarm["until"] or "9999")]
    margins = [row["margins"]["gain_margin_db"] for row in during]
    seen = [margin for margin in margins if margin is not None]
    if len(seen) < 2:
        return ""
    if margins[-1] is None:
        return f", by which the gain margin of {seen[0]:.1f} dB is gone"
    return f", by which the gain margin goes from {seen[0]:.1f} to {seen[-1]:.1f} dB"


def _who(alarm: Mapping[str, Any]) -> str:
    """What changed: nothing has a name that explains too little of it."""
    names = " or ".join(alarm["among"])
    return names if alarm["effect"] else f"Something that no suspect explains (nearest: {names or 'none'})"


def standing(alarms: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Alarms of what has not gone again."""
    return [alarm for alarm in alarms if alarm["until"] is None]


def _course(told: NamedChange, weeks: np.ndarray, marks: Sequence[Mark]) -> Panel:
    """What is named, by its own fits."""
    at = sorted(told.course)
    value = np.array([told.course[t][0] for t in at])
    half = NORMAL * np.array([told.course[t][1] for t in at])
    band = (value - half, value + half)
    return Panel(told.label, [Curve(told.name.among[0], weeks[at], value, "points", band=band)], marks=marks)


def _values(column: Sequence[float | None]) -> np.ndarray:
    return np.array([np.nan if value is None else value for value in column], dtype=float)


def _wanders(seen: np.ndarray) -> float:
    """How far an axis [3, T] wanders, over its intervals; -1 where no session tells it."""
    value, low, high = seen[:, np.isfinite(seen[0])]
    return float(np.ptp(value) / (high - low).mean()) if value.size else -1.0


def _not_told(known: History, seen: np.ndarray) -> list[str]:
    names = [axis.name for k, axis in enumerate(known.axes) if _wanders(seen[:, :, k]) < 0]
    return [f"No session tells {listed(names)}: the rig keeps what its file has."] if names else []


def _panel(known: History, weeks: np.ndarray, seen: np.ndarray, k: int, marks: Sequence[Mark]) -> Panel:
    axis, (value, low, high) = known.axes[k], seen[:, :, k]
    return Panel(
        f"{axis.name} [{axis.unit}]", [Curve(axis.name, weeks, value, "points", band=(low, high))], marks=marks
    )


def _alarms(alarms: Sequence[Mapping[str, Any]]) -> Table | str:
    if not alarms:
        return "No alarm."
    rows = [
        [_who(a), a["since"], " to ".join(a["since_between"]), a["until"], a["shape"],
         *((a["rate"] or {}).get(key) for key in ("value", "low", "high", "unit")), a["share"], a["told"]]
        for a in alarms
    ]  # fmt: skip
    columns = ["what", "since", "between", "gone since", "how", "size or rate", "low", "high", "unit"]
    columns += ["explains [1]", "told on"]
    note = "Low and high: 95 %."
    if not all(alarm["effect"] for alarm in alarms):
        note += " What has no name has no size either: trace a session since then (jackbench trace FOLDER/SESSION)."
    for alarm in alarms:
        if alarm["record"]:
            note += f" {' and '.join(alarm['among'])} explain the sessions alike. To part them: "
            note += "; ".join(alarm["record"]) + "."
    return Table("", columns, rows, note)


def _healthy(metrics: Mapping[str, Any]) -> list[str]:
    """How often a healthy rig would have an alarm."""
    rate = metrics["healthy"]
    if rate is None:
        return []
    return [
        f"False alarms: {rate['alarms']} in {rate['years']:.0f} years of healthy rigs that were drawn from these "
        f"sessions: {rate['low']:.2g} to {rate['high']:.2g} a year with 95 %, where "
        f"{metrics['false_alarms_a_year']:.2g} a year is asked for."
    ]


def _forecast(metrics: Mapping[str, Any]) -> list[Table | str]:
    why = [metrics["no_forecast"]] if metrics["no_forecast"] else []
    lines = [
        [MetricView().head(row["figure"]), row["limit"], row["from"], row["to"], row["by"]]
        for row in metrics["forecast"]
    ]
    note = "80 %, if what changes goes on as it does."
    table = Table("When the loop passes a limit", ["figure", "limit", "from", "to", "by"], lines, note)
    return [*([table] if lines else []), *why]


def _retuning(metrics: Mapping[str, Any], shown: MetricView) -> list[Table]:
    """What a search on the rig as it is gives back."""
    again = metrics["retuning"]
    if again is None:
        return []
    before, after = (
        {"scenario": again["scenario"]} | {key: pair[k] for key, pair in again["gain"].items()} for k in (0, 1)
    )
    lines = [[shown.head(key), shown.cell(before, key), shown.cell(after, key)] for key in again["gain"]]
    note = f"{again['scenario']} on the rig of the newest session, after a search of {again['trials']} designs."
    if again["missed"]["retuned"]:
        note += f" The best of them still misses: {again['missed']['retuned']}."
    return [Table("What retuning would give back now", ["figure", "as it is", "retuned"], lines, note)]


def _residuals(rows: Sequence[Mapping[str, Any]]) -> Table:
    """What the rig of the first session, held to healthy wander, leaves of each signal, beside the first sessions."""
    usual = [row["residuals"] for row in rows[:FEWEST]]
    lines = [
        [name, value, float(np.median([each[name] for each in usual if name in each] or [np.nan]))]
        for name, value in rows[-1]["residuals"].items()
    ]
    note = "RMS of the errors over the sensor's noise: 1 is all noise. What has no name yet shows here first."
    return Table(f"Residual of {rows[-1]['date']}", ["signal", "newest [1]", "first sessions [1]"], lines, note)


def _left_out(lines: Sequence[str]) -> list[Table]:
    return [Table("Left out", ["session and reason"], [[line] for line in lines])] if lines else []


def _sessions(sessions: Sequence[DatedSession], rows: Sequence[Mapping[str, Any]]) -> Table:
    lines = [
        [row["date"], row["chi2"], None if s.temperature is None else s.temperature - 273.15, s.hours, row["remark"],
         *(MetricView().cell(row["margins"], key) for key in FIGURES)]
        for s, row in zip(sessions, rows, strict=True)
    ]  # fmt: skip
    heads = ["date", "chi2 of the fit [1]", "oil [degC]", "hours [h]", "remark", *map(MetricView().head, FIGURES)]
    return Table("Every session", heads, lines)
