"""A controller over the envelope of a set of rigs: its hard goals, and what steps and loads with noise do at worst; and
which controller to take of those that were judged so, in a sentence.

The envelope: rigs that differ in their plants' numbers only, at five positions; specimens relaxed there.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..control.protocol import Controller, NoLinearView
from ..rigs.rig import Rig
from .envelope import Envelope, EnvelopeSteps, envelope, steps
from .hard_goals import Goal, linear_goals, motion_goals
from .metrics import METRICS
from .rig_variations import with_delay
from .scenarios import Limits, Scenario

EnvelopeRow = dict[str, Any]  # of metrics.json
EnvelopeEntry = dict[str, Any]  # what a stage can store
_CLOUD_HZ = np.geomspace(0.5, 200.0, 961)  # fine enough for a mode of damping 0.02
_STEPS = {"position": 10e-3, "force": 20e3}  # SI: the step that is nearest to it is judged


def has_envelope(scenarios: Sequence[Scenario]) -> bool:
    """Whether a controller is judged over an envelope: where one of its scenarios is a step."""
    return bool(_steps(scenarios))


def envelope_rigs(rigs: Mapping[str, Rig]) -> dict[str, Rig]:
    """Those rigs of a set, by name and the nominal one first, that one envelope can hold."""
    nominal = next(iter(rigs.values()))
    return {name: rig for name, rig in rigs.items() if _alike(rig, nominal)}


def envelope_of(rigs: Mapping[str, Rig], delay: float) -> Envelope:
    """The envelope of a set of rigs with a computing delay [s]. Raises InputError where there is no operating point."""
    return envelope({name: with_delay(rig, delay) for name, rig in envelope_rigs(rigs).items()})


def judged_step(scenarios: Sequence[Scenario]) -> Scenario:
    """The step whose settling over the envelope is judged."""
    return min(_steps(scenarios), key=lambda each: abs(np.log(abs(each.size) / _STEPS[each.signal])))


def envelope_entry(
    spec: ControllerSpec,
    envelope: Envelope,
    rigs: Mapping[str, Rig],
    scenarios: Sequence[Scenario],
    seed: int | None,
) -> EnvelopeEntry | None:
    """A controller's `row` of metrics.json, SI but for what its keys say, and its open loops at null `cloud`, to be
    stored as a stage; `seed` of the sensors' noise, or None. Steps on a specimen that is not nominal are apart. Every
    controller is judged on the same plants.

    None for a controller without a linear view.
    """
    controller = spec.build(envelope.rig.period.value)
    try:
        loops = envelope.varied.open_loops(controller, _CLOUD_HZ)
    except NoLinearView:
        return None
    cloud = {"f_hz": _CLOUD_HZ, "open_real": np.real(loops), "open_imag": np.imag(loops)}
    cloud |= {"rigs": _rig_names(envelope.varied.names)}
    return {"row": _row(spec, controller, envelope, rigs, scenarios, seed), "cloud": cloud}


def _row(
    spec: ControllerSpec,
    controller: Controller,
    envelope: Envelope,
    rigs: Mapping[str, Rig],
    scenarios: Sequence[Scenario],
    seed: int | None,
) -> EnvelopeRow:
    limits = Limits()
    goals = list(linear_goals(envelope, controller, limits))
    goals += motion_goals(envelope, controller, _steps(scenarios)[:1], limits)
    rows = [_goal(goal, stable=goals[0].miss == 0) for goal in goals]
    values = {row["name"]: row["value"] for row in rows}
    scenario = judged_step(scenarios)
    lanes = envelope.played(controller)
    loads = ((each, steps(lanes, controller, each, seed, each.duration)) for each in _loads(scenarios))
    played = {each.name: steps(lanes, controller, each, seed, each.duration) for each in _steps(scenarios)}
    result = played[scenario.name]
    free = np.array(
        [rigs[name].specimen_stiffness == envelope.rig.specimen_stiffness for name in _rig_names(result.names)]
    )
    every = [_step(each, played[each.name], free) for each in _steps(scenarios)]
    own = next(each for each in every if each["scenario"] == scenario.name)
    return {
        "controller": spec.name,
        "goals": rows,
        "met": all(row["miss"] == 0 for row in rows),
        "settling_nominal_s": _longest(result.settling[envelope.are_nominal(result.names)]),
        "settling_worst_s": own["settling_worst_s"],
        "where": own["where"],
        "settling_specimen_s": _longest(result.settling[~free]),
        "overshoot_worst_percent": _longest(result.overshoot),
        "ms_nominal": values["Ms on the nominal rig"],
        "ms_worst": values["Ms on every plant"],
        "loads": [_load(each, played, envelope) for each, played in loads],
        "steps": every,
    }


def _step(scenario: Scenario, played: EnvelopeSteps, free: np.ndarray) -> dict[str, Any]:
    """The worst of a step on the plants that are `free` of another specimen [lanes], and where it is slowest."""
    slowest = int(np.argmax(np.where(free, np.nan_to_num(played.settling, nan=np.inf), -np.inf)))
    return {
        "scenario": scenario.name,
        "settling_worst_s": _longest(played.settling[free]),
        "overshoot_worst_percent": _longest(played.overshoot[free]),
        "where": played.names[slowest],
    }


def _load(scenario: Scenario, steps: EnvelopeSteps, envelope: Envelope) -> dict[str, Any]:
    """From a load's coming: until it is made up for, and how far the jack goes."""
    nominal = envelope.are_nominal(steps.names)
    return {
        "scenario": scenario.name,
        "recovery_nominal_s": _longest(steps.settling[nominal]),
        "recovery_worst_s": _longest(steps.settling),
        "peak_nominal": _longest(steps.peak[nominal]),
        "peak_worst": _longest(steps.peak),
        "where": steps.names[_slowest(steps)],
    }


def _goal(goal: Goal, stable: bool) -> dict[str, Any]:
    """A number that a loop does not have is None: its miss too where some plant is unstable, else it is met."""
    if goal.value is None or np.isfinite(goal.value):
        return asdict(goal)
    return {**asdict(goal), "value": None, "miss": goal.miss if stable else None}


def _steps(scenarios: Sequence[Scenario]) -> list[Scenario]:
    return [scenario for scenario in scenarios if scenario.is_step and scenario.size and not scenario.load]


def _loads(scenarios: Sequence[Scenario]) -> Iterator[Scenario]:
    return (scenario for scenario in scenarios if (scenario.load or scenario.travel) and not scenario.size)


def _alike(rig: Rig, nominal: Rig) -> bool:
    """Whether two rigs differ in numbers of their plants only."""
    same = {key: getattr(nominal, key) for key in ("name", "title", "source", "recordings", "numbers")}
    return replace(rig, **same) == nominal


def _rig_names(lanes: Sequence[str]) -> list[str]:
    """The rigs' names in the names of lanes, which are "rig at position"."""
    return [name.rsplit(" at ", 1)[0] for name in lanes]


def _longest(values: np.ndarray) -> float | None:
    """The largest; None where one is missing, or all."""
    largest = float(np.max(values, initial=-np.inf))
    return largest if np.isfinite(largest) else None


def _slowest(steps: EnvelopeSteps) -> int:
    return int(np.argmax(np.nan_to_num(steps.settling, nan=np.inf)))


def choice(rows: Sequence[EnvelopeRow], step: str) -> str:
    """Which controller to take and where it is weakest; where none meets every goal, which comes nearest. In the words
    of the `step` that is in the goals.

    Of several that meet every goal it is the one that is least behind in the step in which it is most behind the
    soonest of them: one that wins a hair in one step and is slow in another is not the one to take.
    """
    able = [row for row in rows if row["met"] and row["settling_worst_s"] is not None]
    if not able:
        nearest = min(rows, key=shortfall)
        return (
            f"No controller meets every goal and settles over stroke and rigs; nearest comes {nearest['controller']}: "
            f"it {_settles(step, nearest)}, and {_first_miss(nearest)}."
        )
    best = min(able, key=lambda row: (_behind(row, able), row["settling_worst_s"]))
    return (
        f"Take {best['controller']}: it meets every goal over stroke and rigs and {_settles(step, best)}"
        f"{_other_steps(best, step)}; it is weakest in {_weakest(best)}{_sooner(rows, best)}."
    )


def _behind(row: EnvelopeRow, able: Sequence[EnvelopeRow]) -> float:
    """How many times the settling of the soonest a row's is, in the step in which that is most; a step that none
    settles tells nothing."""
    times = [_times(each) for each in able]
    soonest = {name: min(each[name] for each in times) for name in times[0]}
    return max(_times(row)[name] / least for name, least in soonest.items() if np.isfinite(least))


def _times(row: EnvelopeRow) -> dict[str, float]:
    """Worst settling [s] by step."""
    return {each["scenario"]: each["settling_worst_s"] or np.inf for each in row["steps"]}


def _other_steps(row: EnvelopeRow, step: str) -> str:
    """In the sentence: the steps that are not in the goals."""
    others = {name: time for name, time in _times(row).items() if name != step}
    said = [f"{name} within {time:.3g} s" if np.isfinite(time) else f"{name} never" for name, time in others.items()]
    return f" ({', '.join(said)})" if said else ""


def shortfall(row: EnvelopeRow) -> tuple[bool, int, float, float]:
    """How far a row falls short: never settles, goals missed, by how much in all, worst settling [s]."""
    misses = [goal["miss"] for goal in row["goals"] if goal["miss"] != 0]
    settling = row["settling_worst_s"]
    return settling is None, len(misses), sum(miss for miss in misses if miss is not None), settling or np.inf


def _settles(step: str, row: EnvelopeRow) -> str:
    worst = row["settling_worst_s"]
    if worst is None:
        return f"does not settle {step} on {row['where']}"
    return f"settles {step} within {worst:.3g} s at worst, on {row['where']}"


def _weakest(row: EnvelopeRow) -> str:
    """The goal with the least left to its limit."""

    def share(goal: Mapping[str, Any]) -> float:
        ratio = goal["value"] / goal["limit"]
        return 1 / ratio if METRICS[goal["metric"]].better == "more" else ratio

    goal = max((goal for goal in row["goals"] if goal["limit"] and goal["value"]), key=share)
    return f"{goal['name']}, {goal['value']:.3g} with a limit of {goal['limit']:g}, on {goal['where']}"


def _sooner(rows: Sequence[EnvelopeRow], best: EnvelopeRow) -> str:
    """Words on the controller that settles sooner and falls short least; none where no controller settles sooner."""
    sooner = [row for row in rows if (row["settling_worst_s"] or np.inf) < best["settling_worst_s"]]
    if not sooner:
        return ""
    row = min(sooner, key=shortfall)
    slower = [each for each in row["steps"] if _times(row)[each["scenario"]] > _times(best)[each["scenario"]]]
    but = _first_miss(row)
    if row["met"] and slower:
        most = max(slower, key=lambda each: _times(row)[each["scenario"]] / _times(best)[each["scenario"]])
        took = most["settling_worst_s"]
        but = f"{most['scenario']} takes it {took:.3g} s" if took else f"never settles {most['scenario']}"
    return f"; {row['controller']} settles it sooner, within {row['settling_worst_s']:.3g} s, but {but}"


def _first_miss(row: EnvelopeRow) -> str:
    """In the sentence: the first goal that is missed and its worst plant, and how many more there are."""
    missed = [goal for goal in row["goals"] if goal["miss"]]
    if not missed:
        return "misses no goal"
    more = f" and {len(missed) - 1} more" if missed[1:] else ""
    return f'misses "{missed[0]["name"]}" ({missed[0]["where"]}){more}'
