"""A controller over the envelope of a bench: its hard goals, and what steps and loads with noise do at worst.

The envelope: the bench's rigs that differ in their plants' numbers only, at five positions; specimens relaxed there.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.protocol import Controller, NoLinearView
from ...loop.envelope import Envelope, EnvelopeSteps, envelope, steps
from ...loop.hard_goals import Goal, linear_goals, motion_goals
from ...loop.limits import Limits
from ...loop.rig_variations import with_delay
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from ..common.bench_experiment import BenchLoop

EnvelopeRow = dict[str, Any]  # of metrics.json
EnvelopeEntry = dict[str, Any]  # what a stage can store
_CLOUD_HZ = np.geomspace(0.5, 200.0, 961)  # fine enough for a mode of damping 0.02
_STEPS = {"position": 10e-3, "force": 20e3}  # SI: the step of a bench that is nearest to it is judged


def has_envelope(loop: BenchLoop) -> bool:
    """Whether the controllers of a loop are judged over an envelope: of a loop with a step."""
    return bool(_steps(loop))


def envelope_rigs(loop: BenchLoop) -> Mapping[str, Rig]:
    """The rigs of a bench by name that an envelope can have, the nominal one first."""
    return {name: rig for name, rig in loop.rigs.items() if _alike(rig, loop.rigs[loop.first])}


def bench_envelope(loop: BenchLoop, delay: float) -> Envelope:
    """The envelope of a bench with a computing delay [s]. Raises InputError where there is no operating point."""
    return envelope({name: with_delay(rig, delay) for name, rig in envelope_rigs(loop).items()})


def judged_step(loop: BenchLoop) -> Scenario:
    """The step of a bench whose settling over the envelope is judged."""
    return min(_steps(loop), key=lambda scenario: abs(np.log(abs(scenario.size) / _STEPS[loop.signal.name])))


def envelope_entry(spec: ControllerSpec, envelope: Envelope, loop: BenchLoop, seed: int | None) -> EnvelopeEntry | None:
    """A controller's `row` of metrics.json, SI but for what its keys say, and its open loops at null `cloud`, to be
    stored as a stage; `seed` of the sensors' noise, or None. Steps on a specimen that is not nominal are apart.

    None for a controller without a linear view.
    """
    controller = spec.build(envelope.rig.period.value)
    try:
        loops = envelope.varied.open_loops(controller, _CLOUD_HZ)
    except NoLinearView:
        return None
    cloud = {"f_hz": _CLOUD_HZ, "open_real": np.real(loops), "open_imag": np.imag(loops)}
    cloud |= {"rigs": _rig_names(envelope.varied.names)}
    return {"row": _row(spec, controller, envelope, loop, seed), "cloud": cloud}


def _row(
    spec: ControllerSpec, controller: Controller, envelope: Envelope, loop: BenchLoop, seed: int | None
) -> EnvelopeRow:
    limits = Limits()
    goals = list(linear_goals(envelope, controller, limits))
    goals += motion_goals(envelope, controller, _steps(loop)[:1], limits)
    rows = [_goal(goal, stable=goals[0].miss == 0) for goal in goals]
    values = {row["name"]: row["value"] for row in rows}
    scenario = judged_step(loop)
    lanes = envelope.played(controller)
    result = steps(lanes, controller, scenario, seed, scenario.duration)
    free = np.array(
        [loop.rigs[name].specimen_stiffness == envelope.rig.specimen_stiffness for name in _rig_names(result.names)]
    )
    where = int(np.argmax(np.where(free, np.nan_to_num(result.settling, nan=np.inf), -np.inf)))
    return {
        "controller": spec.name,
        "goals": rows,
        "met": all(row["miss"] == 0 for row in rows),
        "settling_nominal_s": _longest(result.settling[envelope.are_nominal(result.names)]),
        "settling_worst_s": _longest(result.settling[free]),
        "where": result.names[where],
        "settling_specimen_s": _longest(result.settling[~free]),
        "overshoot_worst_percent": _longest(result.overshoot),
        "ms_nominal": values["Ms on the nominal rig"],
        "ms_worst": values["Ms on every plant"],
        "loads": [_load(each, steps(lanes, controller, each, seed, each.duration), envelope) for each in _loads(loop)],
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


def _steps(loop: BenchLoop) -> list[Scenario]:
    return [scenario for scenario in loop.scenarios if scenario.is_step and scenario.size and not scenario.load]


def _loads(loop: BenchLoop) -> Iterator[Scenario]:
    return (scenario for scenario in loop.scenarios if (scenario.load or scenario.travel) and not scenario.size)


def _alike(rig: Rig, nominal: Rig) -> bool:
    """Whether two rigs differ in numbers of their plants only."""
    same = {key: getattr(nominal, key) for key in ("name", "title", "source", "recordings", "numbers")}
    return replace(rig, **same) == nominal


def _rig_names(lanes: Sequence[str]) -> list[str]:
    """Of lanes that are named "rig at position"."""
    return [name.rsplit(" at ", 1)[0] for name in lanes]


def _longest(values: np.ndarray) -> float | None:
    """The largest; None where one is missing, or all."""
    largest = float(np.max(values, initial=-np.inf))
    return largest if np.isfinite(largest) else None


def _slowest(steps: EnvelopeSteps) -> int:
    return int(np.argmax(np.nan_to_num(steps.settling, nan=np.inf)))
