"""A controller searched for a rig: P, scheduled feedback of the pressures, or of the acceleration where not both are
measured, the lap or an overlap inverted, a shaped reference, and the dither of the first guess."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage, within
from ...base.process_pool import Jobs
from ...control.automatic_tuning import DAMPING, MOST_GAIN, SHARE
from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...control.protocol import is_number
from ...loop.automatic import column
from ...loop.capability import capability, dead_zone
from ...loop.rig_variations import Conditions
from ...loop.scenarios import SCENARIOS, Limits
from ...loop.tuning.goals import Trial
from ...loop.tuning.problem import USUAL_WEIGHTS, Searched, TuneProblem
from ...loop.tuning.search import nearest_trial, search
from ...rigs.number import Number
from ...rigs.rig import Rig

DESIGNS = 300
_RANGE = 4.0  # about a first guess, either way
_NEAR = 1.5  # about the best of these: settling jumps where a swing leaves the band, and a wide search stops between
_OFF = 0.03  # of mass and bulk modulus, by which a rig may be found wrong: a design at the edge of the band fails there
LEADING = 5  # designs, of which the rig decides
_APART = 1.15  # in one number at least: by how much two of these differ
_OVERSHOOT = 5.0  # %
_JUMPED, _LEAST = 0.8, 5e-4  # of an overlap; share of the travel below which there is none


def searched_designs(
    rig: Rig, start: ControllerSpec, name: str, goal: str, stage: Stage, progress: Progress, jobs: Jobs
) -> tuple[list[ControllerSpec], str | None]:
    """The leading designs for a rig within what is uncertain of it, from the automatic one, best first, no two of them
    alike, and the hard goal that the best misses, if it does."""
    whole = _structure(rig, start)
    problem = TuneProblem(
        rig=rig,
        controller=whole,
        searched=_searched(whole),
        scenarios=(SCENARIOS[goal],),
        rigs={"nominal": rig, **_beside(rig)},
        weights={**USUAL_WEIGHTS, "settling_s": 60.0},
        trials=DESIGNS,
        seed=1,
        conditions=Conditions(),
        limits=Limits(overshoot_percent=_OVERSHOOT, command_rms=_noise(whole)),
    )
    wide = search(problem, within(stage, "wide"), progress, jobs)
    middle = nearest_trial(wide).values
    about = tuple(_about(whole, each, middle[each.name], _NEAR) for each in problem.searched)
    near = search(replace(problem, searched=about), within(stage, "near"), progress, jobs)
    leading = _leading([*near, *wide])
    return [problem.design(trial.values).named(name) for trial in leading], leading[0].verdict.missed


def _leading(trials: Sequence[Trial]) -> list[Trial]:
    """The best of the trials, and those next to it that miss no goal and are unlike all before them."""
    best, *others = sorted(trials, key=lambda trial: trial.verdict.score)
    leading = [best]
    for trial in others:
        if len(leading) == LEADING or trial.verdict.missed:
            break
        if all(_unlike(trial, each) for each in leading):
            leading.append(trial)
    return leading


def _unlike(one: Trial, other: Trial) -> bool:
    return any(max(a / b, b / a) >= _APART for a, b in ((one.values[name], other.values[name]) for name in one.values))


def _noise(whole: ControllerSpec) -> float:
    """RMS of the command at rest that is allowed [1]: what always is, and the dither."""
    dither = _part(whole, "Dither")
    return float(np.hypot(Limits().command_rms, 0.0 if dither is None else dither.design.amplitude / np.sqrt(2)))


def _beside(rig: Rig) -> dict[str, Rig]:
    """The rig with its mode a little lower, and a little higher, where it has a mass and an oil."""
    if not {"M", "beta"} <= rig.numbers.keys():
        return {}
    more, less = 1 + _OFF, 1 - _OFF
    return {
        "slower": rig.with_values(M=more * rig["M"], beta=less * rig["beta"]),
        "faster": rig.with_values(M=less * rig["M"], beta=more * rig["beta"]),
    }


def exactly(rig: Rig) -> Rig:
    """The rig were its numbers known as they are given."""
    stroke = rig.limits["stroke"]
    inside = replace(stroke, value=min(stroke.value, rig["S"] / 2))  # bounds of S let it be more
    return replace(rig, limits={**rig.limits, "stroke": inside}).with_each_number(_exact)


def _exact(number: Number) -> Number:
    return replace(number, low=None, high=None, interval=None)


def experiment_of(spec: ControllerSpec, rig_file: str) -> dict[str, Any]:
    """A step experiment with this controller, which `jackbench run` takes."""
    return {
        "experiment": "step",
        "rig": rig_file,
        "scenarios": ["position-1mm", "position-10mm", "position-100mm"],
        "controllers": {spec.name: {**_table(spec), "compensators": [_table(part) for part in spec.compensators]}},
        "bode": {"low_hz": 0.5, "high_hz": 30.0, "points": 8, "amplitudes_mm": [1.0]},
    }


def _table(part: ControllerSpec) -> dict[str, Any]:
    numbers = {
        entry.name: {"value": float(getattr(part.design, entry.name)), "unit": entry.metadata["unit"]}
        for entry in fields(part.design)
        if is_number(entry)
    }
    return {"use": part.use, **numbers}


def _structure(rig: Rig, start: ControllerSpec) -> ControllerSpec:
    whole, lands = _damped(rig, start), _lands(rig)
    if lands is not None:
        whole += lands
    whole += controller("controllers.shaping:Shaping", corner=25.0, lead=0.005, notch=20.0)
    dither = _part(start, "Dither")
    return whole + dither if dither else whole


def _damped(rig: Rig, start: ControllerSpec) -> ControllerSpec:
    """P of a first guess with feedback of both pressures. Where they are not measured, acceleration takes their place,
    with gains by the rules of control/automatic_tuning for half of the critical damping; else P is alone."""
    p = controller("controllers.p:P", gain=float(start.design.gain))
    if {"pa", "pb"} <= rig.sensors.keys():
        first = controller("controllers.pressure:PressureFeedback", gain=1e-10, corner=0.5, column=column(rig))
        return p + (_part(start, "PressureFeedback") or first)
    if "acceleration" not in rig.sensors or not {"M", "beta"} <= rig.numbers.keys():
        return p
    gives = capability(rig)
    w = 2 * np.pi * gives.mode
    p = controller("controllers.p:P", gain=min(SHARE * 2 * DAMPING * w / gives.v0, MOST_GAIN))
    return p + controller("controllers.acceleration:AccelerationFeedback", gain=2 * DAMPING / (gives.v0 * w))


def _part(whole: ControllerSpec, kind: str) -> ControllerSpec | None:
    """What a controller has of a kind of compensator."""
    return next((part for part in whole.compensators if part.use.endswith(f":{kind}")), None)


def _lands(rig: Rig) -> ControllerSpec | None:
    """The inverse of the lands: of an overlap that the rig has, most of what is sure of it; else of its lap."""
    overlap = dead_zone(rig)
    sure = 0.0 if overlap is None else min(overlap.uncertain or (overlap.value,))
    if sure > _LEAST:
        return controller("controllers.lap_inverse:LapInverse", excess=-_JUMPED * sure, width=sure)
    if not {"eps", "z3max"} <= rig.numbers.keys():
        return None
    lap = rig["eps"] / rig["z3max"]
    return controller("controllers.lap_inverse:LapInverse", excess=0.9 * lap, width=1.2 * lap)


def _searched(whole: ControllerSpec) -> tuple[Searched, ...]:
    paths: list[tuple[str | int, ...]] = [("gain",)]
    for i, part in enumerate(whole.compensators):
        names = _NUMBERS.get(part.use.rpartition(":")[2], ())
        paths += [("compensators", i, name) for name in names if getattr(part.design, name) > 0]
    return tuple(_first(whole, path) for path in paths)


_NUMBERS = {
    "PressureFeedback": ("gain",),
    "AccelerationFeedback": ("gain",),
    "LapInverse": ("excess",),
    "Shaping": ("corner", "lead", "notch"),
}


def _first(whole: ControllerSpec, path: tuple[str | int, ...]) -> Searched:
    part, own = _at(whole, path)
    value = float(getattr(part.design, str(path[-1])))
    return _about(whole, Searched(path, own["unit"], value, value, value, True), value, _RANGE)


def _about(whole: ControllerSpec, number: Searched, value: float, ratio: float) -> Searched:
    """A number about a value, within what its controller takes."""
    _, own = _at(whole, number.path)
    return replace(number, low=max(value / ratio, own["low"]), high=min(value * ratio, own["high"]), start=value)


def _at(whole: ControllerSpec, path: tuple[str | int, ...]) -> tuple[ControllerSpec, Mapping[str, Any]]:
    """The part of a controller that a path leads into, and the unit and the bounds of the number there."""
    part = whole if len(path) == 1 else whole.compensators[int(path[1])]
    return part, next(entry.metadata for entry in fields(part.design) if entry.name == path[-1])
