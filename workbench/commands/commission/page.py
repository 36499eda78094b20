"""The report of a commissioning: what each way to a controller brings on the rig itself, then what was found."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.signals import SIGNALS
from ...link.commissioning.allowed import is_of
from ...link.commissioning.obstacles import told
from ...link.commissioning.verify import SINE, SINES, WATCHED, responses
from ...report import Figure, Page, Section, Table
from ...report.figures import FrequencyCurve, bode
from ...rigs.rig import Rig
from ..common.limits_told import limits_section, trip_marks
from ..common.time_figure import time_figure

if TYPE_CHECKING:
    from ...link.course import Judged

_WORDS = {
    "automatic": "no model: rules and small moves",
    "datasheet": "tuned on the datasheet",
    "found": "tuned on the found rig",
    "limit": "the limit: what physics allows the found rig",
}
_STAYS = {
    "automatic": "by rules",
    "datasheet": "tuned on the datasheet",
    "found": "tuned on the found rig",
}
_SHORT = {"automatic": "no model", "datasheet": "datasheet", "found": "found rig", "limit": "the limit"}
_STEPS = (
    "Predicted: in simulation on the rig that the controller was made for, and on 60 drawn within what is uncertain of "
    "it. The limit: what physics allows the found rig."
)
_SINES = "RMS of the error over that of the reference, which has the same speed at all frequencies."
_STIFFNESS = "The least against a load, at any frequency. Not measured: nothing pushes at the rig by a known force."


def commission_page(
    rig: Rig, goal: str, metrics: Mapping[str, Any], judged: Sequence["Judged"], sentence: str, last: Figure
) -> tuple[Page, Figure]:
    """The report and its telling figure: the goal's step by every way, as measured, or the `last` record without."""
    figure = _figure(goal, judged) or last
    lines = [list(each.values()) for each in metrics["played"]]
    played = Table("", ["record", "for", "seconds"], lines, f"In all {metrics['rig_seconds']:.0f} s of the rig.")
    sections = [
        Section("What each way brings", [_whole(goal, metrics), figure]),
        Section("What was found, and whether it suffices", [sentence, *_rounds(metrics)]),
        Section("Every step and sine", [*_tables(metrics), *_responses(judged)]),
        limits_section(rig, _made_smaller(metrics)),
        Section("What was played", [played]),
    ]
    if metrics["obstacles"]:
        sections.insert(0, Section("What stands in the way", told(metrics["obstacles"])))
    return Page("Commissioning", _verdict(goal, metrics), sections), figure


def _made_smaller(metrics: Mapping[str, Any]) -> list[str]:
    """What limits made smaller, or left out, and why; what both rounds did alike is said once."""
    lines = (
        f"{each['way']}, {each['scenario']}: "
        + ("left out" if each["size"] is None else f"played at {1e3 * each['size']:.3g} mm")
        + f", since {each['why']} at its own size."
        for each in metrics["smaller"]
    )
    return list(dict.fromkeys(lines))


def barred_page(rig: Rig, metrics: Mapping[str, Any], figure: Figure) -> tuple[Page, Figure]:
    """The report where nothing was tuned, with the `figure` of the record after which nothing was played."""
    heads, lines = ["record", "for", "seconds"], [list(each.values()) for each in metrics["played"]]
    sections = [
        Section("What stands in the way", [*told(metrics["obstacles"]), figure]),
        limits_section(rig),
        Section("What was played", [Table("", heads, lines, f"In all {metrics['rig_seconds']:.0f} s of the rig.")]),
    ]
    return Page("Commissioning", f"No controller was made. {metrics['ended']}.", sections), figure


def _verdict(goal: str, metrics: Mapping[str, Any]) -> str:
    rows = {row["way"]: row["settling_s"] for row in metrics["rows"] if is_of(row["scenario"], goal)}
    told = [
        f"{_WORDS[way]}: {_seconds(pair['measured'])} (predicted {_seconds(pair['predicted'])})"
        for way, pair in rows.items()
        if way != "limit"
    ]
    words = f"{goal} settles, measured on the rig: {'; '.join(told)}." if told else f"{goal} was not played to its end."
    if rows.get("limit", {}).get("predicted") is not None:
        words += f" Physics allows {_seconds(rows['limit']['predicted'])}."
    found = f"{metrics['verdict']}: {', '.join(metrics['effects']) or 'no known effect explains them'}"
    found = "that nothing is missing" if metrics["verdict"] == "none" else found
    words += f" The records say {found}." if metrics["rounds"] else f" {_untraced(metrics)}"
    words += f" controller.toml is the one {_STAYS[metrics['way']]}{_why(metrics)}."
    return words + (f" Playing was cut short: {metrics['ended']}." if metrics["ended"] else "")


def _untraced(metrics: Mapping[str, Any]) -> str:
    """Why no round came to its end."""
    why = "the time to compute was over" if metrics["cut"] else "it was ended before"
    return f"No controller was made for the rig as found: {why}."


def _why(metrics: Mapping[str, Any]) -> str:
    """Why another controller stays than that of the rig as found; what table rows say, see `best_way`."""
    found = next((row["settling_s"] for row in metrics["rows"] if row["way"] == "found"), None)
    if metrics["way"] == "found" or found is None:
        return ""
    if metrics["verdict"] == "unknown":
        return ", which did best on the rig: what the records say does not explain them"
    return ", which did best on the rig: the found rig's did not hold what it promised"


def _rounds(metrics: Mapping[str, Any]) -> list[str]:
    """Why a round was followed by another, and what the last one leaves open."""
    told = [f"Round {k + 1}: {reason}." for k, reason in enumerate(metrics["rounds"]) if reason]
    told += [f"The time to compute ended {each}." for each in metrics["cut"]]
    if metrics["exact_s"] is not None:
        told.append(f"Were the rig's numbers known exactly, the goal would settle in {_seconds(metrics['exact_s'])}.")
    return told


def _seconds(value: float | None) -> str:
    return f"not within {WATCHED:g} s" if value is None else f"{value:.3g} s"


def _whole(goal: str, metrics: Mapping[str, Any]) -> Table:
    """What every way brings, a line each: the goal's step, the sine of 5 Hz, the stiffness."""
    heads = [f"way: {goal}", "settling [s], predicted", "measured", "overshoot [%], predicted", "measured"]
    heads += ["error of a 5 Hz sine [%], predicted", "measured", "stiffness [kN/mm], predicted"]
    steps = {row["way"]: row for row in metrics["rows"] if is_of(row["scenario"], goal)}
    sines = {row["way"]: row for row in metrics["rows"] if is_of(row["scenario"], SINE)}
    lines = [
        [_WORDS[way], *_pair(row["settling_s"]), *_pair(row["overshoot_percent"]),
         *_pair(sines.get(way, row)["sine_error"], 100), _scaled(row["stiffness"]["predicted"], 1e-6)]
        for way, row in steps.items()
    ]  # fmt: skip
    return Table("", heads, lines, f"{_SINES} {_STIFFNESS}")


def _pair(pair: Mapping[str, Any], factor: float = 1.0) -> list[float | None]:
    return [_scaled(pair[key], factor) for key in ("predicted", "measured")]


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _tables(metrics: Mapping[str, Any]) -> list[Table]:
    """Every step and sine of every way."""
    steps, sines = ([row for row in metrics["rows"] if (row["scenario"] in SINES) is sine] for sine in (False, True))
    heads = ["way", "scenario", "settling [s], predicted", "of 95 % of plants", "measured"]
    heads += ["overshoot [%], predicted", "measured"]
    return [
        Table("", heads, [_step(row) for row in steps], _STEPS),
        Table("", ["way", "scenario", "error [%], predicted", "measured"], [_sine(row) for row in sines]),
    ]


def _step(row: Mapping[str, Any]) -> list[Any]:
    settling, overshoot = row["settling_s"], row["overshoot_percent"]
    between = settling.get("between")
    if between is not None:
        ends = ["never" if end is None or end == np.inf else f"{end:.3g}" for end in between]
        between = " to ".join(dict.fromkeys(ends))
    told = settling["predicted"], between, settling["measured"], overshoot["predicted"], overshoot["measured"]
    return [_SHORT[row["way"]], row["scenario"], *told]


def _sine(row: Mapping[str, Any]) -> list[Any]:
    return [_SHORT[row["way"]], row["scenario"], *_pair(row["sine_error"], 100)]


def _responses(judged: Sequence["Judged"]) -> list[Figure]:
    f, predicted, measured = responses(judged, "found")
    if not len(f):
        return []
    curves = [FrequencyCurve("predicted", f, predicted), FrequencyCurve("measured on the rig", f, measured, "markers")]
    note = "The found rig's controller, position over reference, sine by sine; all sines have the same speed."
    return [bode("Closed loop", curves, note)]


def _figure(goal: str, judged: Sequence["Judged"]) -> Figure | None:
    own = [each for each in judged if is_of(each.scenario.name, goal)]
    if not own:
        return None
    runs = {_WORDS[each.controller]: each.measured.record for each in own}
    marks = [mark for each in own for mark in trip_marks(each.trip and each.trip.t)]
    title, rows = f"{goal}, measured on the rig", [each.row for each in own]
    return time_figure(title, SIGNALS["position"], runs, ("command",), own[0].scenario, rows, marks)
