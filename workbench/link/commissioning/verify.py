"""Scenarios played on the rig by every way to a controller, measured beside predicted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ...base.checkpoint import Progress
from ...control.controller_spec import ControllerSpec
from ...control.protocol import NoLinearView
from ...loop.rig_variations import Conditions
from ...loop.rows import judge, linear_loops, loop_setup
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import SCENARIOS, Scenario
from ...loop.sensors import settling_band
from ...loop.stiffness_and_noise import dynamic_stiffness
from ...rigs.rig import Rig
from ..course import Judged, PlayedCourse, judge_played, wire_rig
from .allowed import Allowed, ExpectedStep, allowed, is_of, smaller
from .obstacles import Barred
from .rig_time import RigTime

SINE = "position-sine-5hz"
SINES = tuple(name for name in SCENARIOS if name.startswith("position-sine-"))
"""Of the bode plot, slowest first."""
STEPS = ("position-1mm", "position-10mm", "position-100mm")
_ELSEWHERE = "position-10mm"
WATCHED = 1.0  # s of a step
_SLOWEST = 0.1  # Hz, that stiffness is looked at from
CLOSE = 0.15  # by which a predicted settling may be off the measured one
_OVERSHOOT = 8.0  # %: as far as a controller may go on the rig that was searched for 5 %
_Rank = tuple[bool, bool, float]  # settled not everywhere, not foretold, settling [s]


@dataclass(frozen=True)
class Way:
    """A way's controller, and the plants that it was made for."""

    spec: ControllerSpec
    plants: Allowed

    def stiffness(self) -> float | None:
        """The least that the loop holds against a load [N/m], on its rig without dry friction; None where that has no
        linear view, or is unstable."""
        setup = loop_setup(self.plants.rig)
        f = np.geomspace(_SLOWEST, self.plants.rig.nyquist / 2, 200)
        try:
            if not linear_loops(self.spec, setup).stable:
                return None
            return float(np.abs(dynamic_stiffness(self.spec, setup, f)).min())
        except NoLinearView:
            return None


def played_way(
    spent: RigTime, name: str, way: Way, scenarios: Sequence[str], say: Progress, number: int = 1
) -> list[Judged]:
    """A way's controller, predicted by its model, in every scenario at the live rig until it is stopped or the time is
    over, in the round of a `number`. The measures are the live rig's. A scenario is played as large as every plant of
    the way takes it; after 10 mm that did not settle no further step is played, and nothing larger."""
    judged, spec = list[Judged](), way.spec
    setup = loop_setup(way.plants.rig)
    loops = linear_loops(spec, setup)
    unsettled = False
    for wanted in _places(scenarios, spent.rig):
        if unsettled and (wanted.frequency is None or abs(wanted.size) > SCENARIOS[_ELSEWHERE].size):
            continue
        scenario, why = _taken(way, wanted)
        if why is not None:
            size = None if scenario is None else scenario.size
            spent.smaller.append({"way": name, "scenario": wanted.name, "size": size, "why": why})
        if scenario is None:
            say(f"{name}: {wanted.name} is not played at any size: {why}")
            continue
        say(f"{name}: {scenario.name} on the rig")
        try:
            played = _played(spent, name, spec, scenario, number)
        except Barred as barred:
            say(str(barred))
            break
        if len(played.run.rows) > 1:
            own = spec.named(name)
            told = judge(own, scenario, setup, loops, Conditions().noise)
            judged.append(judge_played(told, own, scenario, played, setup, loops))
        if played.ended is not None:
            say(f"{name}, {scenario.name}: {played.ended}")
            break
        if scenario.name.startswith(_ELSEWHERE) and judged[-1].row["settling_s"] is None:
            say(f"{name}, {scenario.name}: did not settle, so no further step is played, and nothing larger")
            unsettled = True
    return judged


def _taken(way: Way, wanted: Scenario) -> tuple[Scenario | None, str | None]:
    """A scenario as large as every plant of the way takes it, unless noise hides that, and why at no larger size."""
    scenario, why = smaller(way.plants, way.spec, wanted)
    hidden = scenario and hidden_step(way.plants.rig, scenario)
    return (None, "; ".join(filter(None, (why, hidden)))) if hidden else (scenario, why)


def hidden_step(rig: Rig, scenario: Scenario) -> str | None:
    """Why a step tells no settling, in words: it is within the band of the sensor's noise. None where it tells it."""
    band = settling_band(rig, scenario.signal, scenario.size)
    if not scenario.is_step or abs(scenario.size) > band:
        return None
    label = rig.signal(scenario.signal)
    return f"noise hides a step of {label.text(abs(scenario.size))}: within {label.text(band)} a jack counts as settled"


def _played(spent: RigTime, way: str, spec: ControllerSpec, scenario: Scenario, number: int) -> PlayedCourse:
    rig = spent.rig
    t = np.arange(round(scenario.duration / rig.period.value) + 1) * rig.period.value
    start = rig.middle + scenario.position(rig.limit("stroke"))
    name = f"{way}-{scenario.name}" if number == 1 else f"{way}-{scenario.name}-{number}"
    return spent.course(name, "verification", spec, scenario.reference(t), start)


def goal_of(judged: Sequence[Judged], goal: str) -> Judged | None:
    """The goal as it was played, at its own size or smaller; None where it was not."""
    return next((each for each in judged if is_of(each.scenario.name, goal)), None)


def settling_of(judged: Sequence[Judged], goal: str) -> float | None:
    """What the goal settled in [s], measured; None where it did not, or was not played."""
    own = goal_of(judged, goal)
    return own and own.row["settling_s"]


def predicted_of(judged: Sequence[Judged], goal: str) -> float | None:
    """What the goal was to settle in [s]; None where it was not to, or was not played."""
    own = goal_of(judged, goal)
    return own and own.prediction["settling_s"]


def foretold(predicted: float | None, measured: float | None) -> bool:
    """Whether a settling [s] is what was predicted; a controller that settles nowhere foretells nothing."""
    return predicted is not None and measured is not None and abs(predicted / measured - 1) <= CLOSE


def best_way(rows: Sequence[Mapping[str, Any]], goal: str, explains: bool) -> str:
    """The way whose controller stays: the found rig's, whose margins are known, where the rig as found `explains` the
    records and foretold the goal's settling; else of those that settled everywhere without too much overshoot the one
    that did the goal soonest, or of those that settled the goal alone. Where none did, the found rig's, or the one by
    rules if no rig was found."""
    own = [row for row in rows if is_of(row["scenario"], goal) and row["way"] != "limit"]
    soonest = {row["way"]: row["settling_s"] for row in own}
    reached = [way for way, pair in soonest.items() if pair["measured"] is not None and _within(rows, way, goal)]
    held = [way for way in reached if _settled(rows, way)] or reached
    known = explains and "found" in held and foretold(soonest["found"]["predicted"], soonest["found"]["measured"])
    if held and not known:
        return min(held, key=lambda way: soonest[way]["measured"])
    return "found" if "found" in soonest else "automatic"


def _within(rows: Sequence[Mapping[str, Any]], way: str, goal: str) -> bool:
    """Whether the goal had no more overshoot than was searched for, wherever it began."""
    own = [row for row in rows if row["way"] == way and row["scenario"].startswith(goal)]
    return all((row["overshoot_percent"]["measured"] or 0.0) <= _OVERSHOOT for row in own)


def _settled(rows: Sequence[Mapping[str, Any]], way: str) -> bool:
    """Whether every step did."""
    steps = [row for row in rows if row["way"] == way and row["scenario"] not in SINES]
    return all(row["settling_s"]["measured"] is not None for row in steps)


def limit_row(scenario: str, limit: float | None) -> dict[str, Any]:
    """A row of commission.json: what physics allows the rig as found."""
    empty = {"predicted": None, "measured": None}
    return {"way": "limit", "scenario": scenario, "settling_s": {**empty, "predicted": limit},
            "overshoot_percent": empty, "sine_error": empty, "stiffness": empty}  # fmt: skip


def table_row(each: Judged, expected: ExpectedStep, stiffness: float | None) -> dict[str, Any]:
    """A row of commission.json; `between`: where 95 % of the plants lie that the way allows. A stiffness is not
    measured, as nothing pushes at the rig."""
    pairs = {
        key: {"predicted": each.prediction[key], "measured": each.row[key], "between": between}
        for key, between in asdict(expected).items()
    }
    sine = {"predicted": None, "measured": None}
    if each.scenario.frequency is not None:
        sine = {
            "predicted": _sine_error(each.predicted, each.scenario),
            "measured": _sine_error(each.measured, each.scenario),
        }
    return {"way": each.controller, "scenario": each.scenario.name, **pairs, "sine_error": sine,
            "stiffness": {"predicted": stiffness, "measured": None}}  # fmt: skip


def responses(judged: Sequence[Judged], way: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Responses of a way: frequencies [k] in Hz, and position over reference, [k] complex, predicted, measured."""
    sines = [each for each in judged if each.controller == way and each.scenario.frequency is not None]
    sines.sort(key=lambda each: each.scenario.frequency or 0.0)
    f = np.array([each.scenario.frequency for each in sines], float)
    told = ([_response(run, each.scenario) for run in (each.predicted, each.measured)] for each in sines)
    both = np.array(list(told), complex).reshape(-1, 2)
    return f, both[:, 0], both[:, 1]


def _response(run: LoopRun, scenario: Scenario) -> complex:
    """Position over reference at a sine's frequency, of the later half; NaN where that was not played."""
    half = len(run.record.t) // 2
    if run.tripped is not None or half < 10 or scenario.frequency is None:
        return complex(np.nan, np.nan)
    t = run.record.t[half:] - run.record.t[half]
    turn = np.exp(2j * np.pi * scenario.frequency * t)
    parts = np.stack([turn.real, turn.imag, np.ones_like(t), t], axis=1)
    wanted, did = (
        np.linalg.lstsq(parts, run.record.signals[name][half:], rcond=None)[0]
        for name in ("reference", scenario.signal)
    )
    return complex((did[0] - 1j * did[1]) / (wanted[0] - 1j * wanted[1]))


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
    return scenario if scenario.frequency else replace(scenario, duration=min(scenario.duration, WATCHED))


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


def rig_decides(
    spent: RigTime, model: Rig, designs: Sequence[ControllerSpec], goal: str, number: int, say: Progress
) -> ControllerSpec:
    """The design for a `model` that did the goal soonest on the rig. One that settled wherever the goal began comes
    before all that did not, and of those one whose settling was foretold. Once one was cut short, or the rig's time is
    over, no further one is played."""
    if len(designs) == 1:
        return designs[0]
    plants, trips, ranks = allowed(wire_rig(model, spent.client)), len(spent.trips), list[_Rank]()
    for place, spec in enumerate(designs, 1):
        judged = played_way(spent, f"leading-{place}", Way(spec, plants), (goal,), say, number)
        ranks.append(_rank(judged, goal))
        if spent.over or len(spent.trips) > trips:
            break
    best = min(range(len(ranks)), key=ranks.__getitem__)
    say(f"of {len(ranks)} designs the rig does {goal} best with number {best + 1}")
    return designs[best]


def _rank(judged: Sequence[Judged], goal: str) -> _Rank:
    measured = settling_of(judged, goal)
    everywhere = bool(judged) and all(each.row["settling_s"] is not None for each in judged)
    return not everywhere, not foretold(predicted_of(judged, goal), measured), np.inf if measured is None else measured
