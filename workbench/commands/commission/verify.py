"""Scenarios played on the rig by every way to a controller, measured beside predicted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...link.course import Played
from ...loop.conditions import Conditions
from ...loop.rows import linear_loops, loop_setup
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import SCENARIOS, Scenario
from ...rigs.rig import Rig
from ..common.outcome import Progress
from ..common.wire_campaign import wire_rig
from ..drive.study import Judged, judge_played
from .obstacles import Barred
from .rig_time import RigTime

SINE = "position-sine-5hz"
STEPS = ("position-1mm", "position-10mm", "position-100mm")
_ELSEWHERE = "position-10mm"
_WATCHED = 1.0  # s of a step
_OVERSHOOT = 8.0  # %: as far as a controller may go on the rig that was searched for 5 %


def played_way(
    spent: RigTime, way: str, spec: ControllerSpec, model: Rig, scenarios: Sequence[str], say: Progress, number: int = 1
) -> list[Judged]:
    """A way's controller, predicted by its model, in every scenario at the live rig until it is stopped or the time is
    over, in the round of a `number`. The measures are the live rig's. After 10 mm that did not settle nothing larger is
    played."""
    judged, rig = list[Judged](), spent.rig
    setup = loop_setup(wire_rig(model, spent.client))
    loops = linear_loops(spec, setup)
    for scenario in _places(scenarios, rig):
        say(f"{way}: {scenario.name} on the rig")
        try:
            played = _played(spent, way, spec, scenario, number)
        except Barred as barred:
            say(str(barred))
            break
        if len(played.run.rows) > 1:
            judged.append(judge_played(Conditions(), spec.named(way), scenario, played, setup, loops))
        if played.ended is not None:
            say(f"{way}, {scenario.name}: {played.ended}")
            break
        if scenario.name.startswith(_ELSEWHERE) and judged[-1].row["settling_s"] is None:
            say(f"{way}, {scenario.name}: did not settle, so nothing larger is played")
            break
    return judged


def _played(spent: RigTime, way: str, spec: ControllerSpec, scenario: Scenario, number: int) -> Played:
    rig = spent.rig
    t = np.arange(round(scenario.duration / rig.period.value) + 1) * rig.period.value
    start = rig.middle + scenario.position(rig.limit("stroke"))
    name = f"{way}-{scenario.name}" if number == 1 else f"{way}-{scenario.name}-{number}"
    return spent.course(name, "verification", spec, scenario.reference(t), start)


def settling_of(judged: Sequence[Judged], goal: str) -> float | None:
    """What the goal settled in [s], measured; None where it did not, or was not played."""
    return next((each.row["settling_s"] for each in judged if each.scenario.name == goal), None)


def best_way(rows: Sequence[Mapping[str, Any]], goal: str) -> str:
    """The way whose controller stays: the found rig's, whose margins are known, where it settled everywhere without too
    much overshoot; else of those that did so the one that did the goal soonest. Where none did, the found rig's, or
    the one by rules if no rig was found."""
    soonest = {row["way"]: row["settling_s"]["measured"] for row in rows if row["scenario"] == goal}
    held = [way for way, settling in soonest.items() if settling is not None and _held(rows, way, goal)]
    if held and "found" not in held:
        return min(held, key=lambda way: soonest[way])
    return "found" if "found" in soonest else "automatic"


def _held(rows: Sequence[Mapping[str, Any]], way: str, goal: str) -> bool:
    """Whether every step settled, and the goal's without more overshoot than was searched for, wherever it began."""
    steps = [row for row in rows if row["way"] == way and row["scenario"] != SINE]
    return all(row["settling_s"]["measured"] is not None for row in steps) and all(
        (row["overshoot_percent"]["measured"] or 0.0) <= _OVERSHOOT for row in steps if row["scenario"].startswith(goal)
    )


def limit_row(scenario: str, limit: float | None) -> dict[str, Any]:
    """A row of commission.json: what physics allows the rig as found."""
    empty = {"predicted": None, "measured": None}
    return {"way": "limit", "scenario": scenario, "settling_s": {**empty, "predicted": limit},
            "overshoot_percent": empty, "sine_error": empty, "stiffness": empty}  # fmt: skip


def table_row(each: Judged) -> dict[str, Any]:
    """A row of commission.json."""
    pairs = {
        key: {"predicted": each.prediction[key], "measured": each.row[key]}
        for key in ("settling_s", "overshoot_percent")
    }
    sine = {"predicted": None, "measured": None}
    if each.scenario.frequency is not None:
        sine = {
            "predicted": _sine_error(each.predicted, each.scenario),
            "measured": _sine_error(each.measured, each.scenario),
        }
    return {"way": each.controller, "scenario": each.scenario.name, **pairs, "sine_error": sine,
            "stiffness": {"predicted": None, "measured": None}}  # fmt: skip


def _places(names: Sequence[str], rig: Rig) -> Iterator[Scenario]:
    """Scenarios at mid stroke, and the step of 10 mm at two more places, as far as they fit into the stroke."""
    for name in names:
        scenario = _watched(SCENARIOS[name])
        if _fits(scenario, rig):
            yield scenario
        if name == _ELSEWHERE:
            for share in (-0.5, 0.5):
                elsewhere = replace(scenario, name=f"{name}-at{100 * share:+.0f}", start_share=share)
                if abs(elsewhere.position(rig.limit("stroke"))) + abs(scenario.size) < 0.9 * rig.limit("stroke"):
                    yield elsewhere


def _watched(scenario: Scenario) -> Scenario:
    return scenario if scenario.frequency else replace(scenario, duration=min(scenario.duration, _WATCHED))


def _fits(scenario: Scenario, rig: Rig) -> bool:
    return abs(scenario.size) < 0.9 * rig.limit("stroke")


def _sine_error(run: LoopRun, scenario: Scenario) -> float | None:
    """RMS of the error over the later half, as a share of the reference's."""
    signals = run.record.signals
    half = len(run.record.t) // 2
    if run.tripped is not None or half < 10:
        return None
    reference = signals["reference"][half:]
    return float(np.std(reference - signals[scenario.signal][half:]) / np.std(reference))
