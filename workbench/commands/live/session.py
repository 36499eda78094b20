"""Requests of the page, and their answers: plain tables in, plain tables out."""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache, lru_cache
from threading import Lock
from typing import Any

import numpy as np

from ...base.errors import InputError, echo
from ...base.units import from_si, to_si
from ...control.controller_spec import ControllerSpec
from ...loop.metrics import METRICS
from ...loop.plant_lanes import PlantLanes
from ...loop.rows import moving_at
from ...loop.scenarios import Scenario
from ...loop.tuning.problem import with_number
from ..common.judged import judged_words
from ..common.page_server import Answers
from .after import after_part
from .answer import after_answer, view_answer
from .config import LiveConfig
from .limit import LimitOf, limit_of
from .plants import RigPoint, moved_lanes, set_lanes
from .saved import save_experiment
from .sliders import Slider, design_sliders, rig_sliders
from .view import LiveTask, linear_part, machine_code, step_part


@dataclass(frozen=True)
class Request:
    """What the page shows: a controller with the numbers that were moved, a scenario, and a rig with other numbers."""

    controller: ControllerSpec
    task: LiveTask
    point: RigPoint


class Session:
    """The loops of an experiment. What is remembered makes answers quicker, never other ones."""

    def __init__(self, config: LiveConfig, limit_of: LimitOf = limit_of) -> None:
        self.config, self._limit_of = config, limit_of
        self._specs = {spec.name: spec for spec in config.steps.controllers}
        self._scenarios = {scenario.name: scenario for scenario in config.steps.scenarios}
        self._rig_sliders = {slider.path[1]: slider for slider in rig_sliders(config.steps.rig)}
        self._sliders = cache(lambda name: {s.name: s for s in design_sliders(config, self._specs[name])})
        self._lanes = lru_cache(4)(lambda delay: set_lanes(config.rigs, delay))
        self._moved = lru_cache(4)(self._moved_lanes)
        self._view_lock, self._after_lock = Lock(), Lock()
        self._lanes_at(Request(config.steps.controllers[0], self._task(config.steps.scenarios[0]), RigPoint()))

    def start(self) -> dict[str, Any]:
        """What the page has to know before it asks: controllers with their sliders, scenarios, goals."""
        steps = self.config.steps
        return {
            "experiment": self.config.name,
            "rig": steps.rig.name,
            "rigs": list(self.config.rigs),
            "signal": {"name": steps.signal.name, "unit": steps.signal.unit},
            "controllers": {name: [_shown(s) for s in self._sliders(name).values()] for name in self._specs},
            "rigSliders": [_shown(slider) for slider in self._rig_sliders.values()],
            "scenarios": list(self._scenarios),
            "amplitudes": [float(from_si(a, steps.signal.unit, steps.signal.si)) for a in steps.bode.amplitudes],
            "notes": _notes(self.config),
            "limits": {"ms_nominal": self.config.limits.ms_nominal, "ms": self.config.limits.ms},
        }

    @property
    def answers(self) -> Answers:
        """What the page may ask for, by name."""
        return {"view": self.view, "after": self.after, "limit": self.limit, "save": self.save}

    def view(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """Margins and frequency responses, and the scenario where that takes no compiler and no Python loop."""
        began = time.perf_counter()
        request = self._request(asked)
        with self._view_lock:
            lanes = self._lanes_at(request)
            controller = request.controller.build(lanes.rig.period.value)
            code = machine_code(lanes, controller, request.task)
            ready = code is not None and lanes.engine.has_law(code)
            steps = step_part(lanes, controller, request.task) if ready else None
            answer = view_answer(lanes, linear_part(lanes, controller), steps, request.task)
        waits = "" if steps is not None else "python" if code is None else "compiler"
        return answer | {"waits": waits, "server_ms": round((time.perf_counter() - began) * 1e3, 2)}

    def after(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """The scenario where `view` had none, the closed loop by sines, and which rigs hunt.

        `view` answers on meanwhile: the engine's runs of many lanes keep nothing that another could disturb.
        """
        request, signal = self._request(asked), self.config.steps.signal
        amplitude = float(to_si(_number(asked, "amplitude"), signal.unit, signal.si))
        with self._after_lock:
            lanes = self._lanes_at(request)
            controller = request.controller.build(lanes.rig.period.value)
            steps = step_part(lanes, controller, request.task)
            linear = linear_part(lanes, controller)
            answer = view_answer(lanes, linear, steps, request.task)
            stable = np.ones(len(lanes.p), bool) if linear is None else linear.stable
            more = after_part(lanes, request.controller, request.task, self.config.steps.bode, amplitude, stable)
        return answer | {"waits": "", "after": after_answer(more, signal)}

    def limit(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """How soon anything could settle the scenario on the nominal rig, as it is moved [s]; null without a limit."""
        request, rig = self._request(asked), self.config.steps.rig
        scenario, point = request.task.scenario, request.point
        inwards = request.task.inwards(point.position, rig.limit("stroke")) if rig.is_jack else 1.0
        placed = replace(scenario, size=inwards * scenario.size, start=point.position, start_share=0.0)
        return {"limit_s": self._limit_of((rig.with_values(**point.values), placed))}

    def save(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """Write the experiment as it is moved; the names of the files."""
        numbers = {name: self._moved_numbers(name, values) for name, values in _table(asked, "moved").items()}
        request = self._request(asked)
        files = save_experiment(self.config, _text(asked, "name"), numbers, request.point, request.task)
        return {"files": [path.name for path in files]}

    def _request(self, asked: Mapping[str, Any]) -> Request:
        name, scenario = _text(asked, "controller"), _text(asked, "scenario")
        if name not in self._specs or scenario not in self._scenarios:
            raise InputError(f"no controller {echo(name)} or no scenario {echo(scenario)}; reload the page")
        spec = self._specs[name]
        for slider, value in self._moved_numbers(name, _table(asked, "numbers")):
            spec = with_number(spec, slider.path, value, slider.unit)
        return Request(spec, self._task(self._scenarios[scenario]), self._point(_table(asked, "rig")))

    def _task(self, scenario: Scenario) -> LiveTask:
        steps = self.config.steps
        return LiveTask(scenario, steps.signal, steps.conditions.noise, self.config.limits)

    def _moved_numbers(self, name: str, values: Any) -> list[tuple[Slider, float]]:
        """Sliders of a controller with what they are moved to, in their units."""
        if name not in self._specs or not isinstance(values, Mapping):
            raise InputError(f"no controller {echo(name)}; reload the page")
        sliders = self._sliders(name)
        if unknown := [key for key in values if key not in sliders]:
            raise InputError(f"{name} has no number {echo(unknown[0])}; reload the page")
        return [(sliders[key], _number(values, key)) for key in values]

    def _point(self, values: Mapping[str, Any]) -> RigPoint:
        if unknown := [key for key in values if key not in self._rig_sliders]:
            raise InputError(f"the rig has no {echo(unknown[0])} to move; reload the page")
        position, numbers = 0.0, {}
        for key in values:
            slider, value = self._rig_sliders[key], _number(values, key)
            if not slider.bounds[0] <= value <= slider.bounds[1]:
                ends = "{:g} to {:g}".format(*slider.bounds)
                raise InputError(f"{slider.meaning}: {value:g} {slider.unit} is outside {ends} {slider.unit}")
            if key == "position":
                position = float(to_si(value, slider.unit, "m"))
            else:
                numbers[key] = float(to_si(value, slider.unit, self.config.steps.rig.numbers[key].si))
        return RigPoint(numbers, position)

    def _lanes_at(self, request: Request) -> PlantLanes:
        rig, point = self.config.steps.rig, request.point
        delay = self.config.steps.conditions.delay(request.controller, rig)
        return self._moved(delay, tuple(sorted(point.values.items())), point.position)

    def _moved_lanes(self, delay: float, values: tuple[tuple[str, float], ...], position: float) -> PlantLanes:
        lanes = self._lanes(delay)
        return moved_lanes(lanes, RigPoint(dict(values), position)) if values or position else lanes


def _notes(config: LiveConfig) -> list[str]:
    """What the numbers of the table are of."""
    limits, signal = config.limits, config.steps.signal
    ms, margin, overshoot = (METRICS[key].limit_words for key in ("ms", "gain_margin_db", "overshoot_percent"))
    goals = f"Goals: {ms(limits.ms_nominal)} on the first rig and {limits.ms:g} on the others, "
    goals += f"{margin(limits.gain_margin_db)} on the first, no trip, no hunting"
    goals += f", {overshoot(limits.overshoot_percent)}." if np.isfinite(limits.overshoot_percent) else "."
    margins = f"Margins: the worse of null and {moving_at(signal, config.steps.rig.passing_speed)}."
    return [goals, margins, judged_words(config.steps.conditions, config.steps.rig)]


def _shown(slider: Slider) -> dict[str, Any]:
    return {**asdict(slider), "name": slider.name, "path": None}


def _text(table: Mapping[str, Any], key: str) -> str:
    if not isinstance(value := table.get(key), str):
        raise InputError(f"{key}: must be text; reload the page")
    return value


def _table(table: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    if not isinstance(value := table.get(key, {}), Mapping):
        raise InputError(f"{key}: must be a table; reload the page")
    return value


def _number(table: Mapping[str, Any], key: str) -> float:
    value = table.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise InputError(f"{key}: must be a number")
    return float(value)
