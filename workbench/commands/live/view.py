"""What a loop does on the rigs of the set: margins, frequency responses, steps, and what is out of the goals."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.signals import Signal
from ...base.units import from_si
from ...control.protocol import Controller, NoLinearView, graph_law
from ...engine import Engine
from ...engine.sampled_law import LawShape
from ...linear import Equilibrium
from ...loop import step_metrics as metrics
from ...loop.batch import play_lanes
from ...loop.compiled_loop import compiled_law
from ...loop.guard_numbers import trip_reason
from ...loop.margins import LaneMargins
from ...loop.metrics import METRICS
from ...loop.plant_lanes import PlantLanes
from ...loop.sampled_loop import SIMULATION_FAILED, SampledLoop
from ...loop.scenarios import Limits, Scenario
from ...loop.sensors import Sensors, settling_band
from ...rigs.rig import Rig
from ..common.metric_table import MetricView

_NOWHERE = "no operating point"
WATCHED = 1.0  # s: of a scenario, after all there is to it has come


@dataclass(frozen=True)
class LiveTask:
    """A scenario of the controlled signal, with the sensors' noise of a seed or without; what the goals ask for."""

    scenario: Scenario
    signal: Signal
    seed: int | None
    limits: Limits = field(default_factory=Limits)

    def times(self, period: float) -> np.ndarray:
        """Instants [k] s that are watched."""
        seconds = min(self.scenario.duration, (self.scenario.arrives or 0.0) + WATCHED)
        return np.arange(round(seconds / period) + 1) * period

    def inwards(self, position: float, stroke: float) -> float:
        """1, or -1 where the jack stands out of the middle and the scenario does not say where it starts."""
        return -1.0 if position > 0 and not self.scenario.position(stroke) else 1.0

    def turned_words(self, rig: Rig, position: float) -> str:
        """That the scenario goes the other way there, and why; nothing where it does not."""
        stroke = rig.limit("stroke") if rig.is_jack else 0.0
        if not self.scenario.size or not rig.is_jack or self.inwards(position, stroke) > 0:
            return ""
        size = float(from_si(-self.scenario.size, self.signal.unit, self.signal.si))
        why = f"the jack stands at {1e3 * position:+g} mm of ±{1e3 * stroke:g} mm"
        return f"{size:+g} {self.signal.unit}, towards mid stroke: {why}"


@dataclass(frozen=True)
class LinearPart:
    """Linear loops: margins at null and moving, the worse of the two; at null the frequencies [k] in Hz and the open
    loop of each rig and, over those of the nominal one, its closed loop [k], None where it is unstable."""

    stable: np.ndarray
    ms: np.ndarray
    gain_margin_db: np.ndarray
    phase_margin_deg: np.ndarray
    curves: list[tuple[np.ndarray, np.ndarray]]
    closed: np.ndarray | None


@dataclass(frozen=True)
class StepPart:
    """A scenario on every rig: controlled signal and command [lanes, k] over t [k] s, reference [k], SI, as deviations
    from the start; settling [s] and overshoot [%] of each, peak deviation [SI] of a load, why its guard tripped."""

    t: np.ndarray
    reference: np.ndarray
    y: np.ndarray
    command: np.ndarray
    settling: list[float | None]
    overshoot: list[float | None]
    peak: list[float | None]
    tripped: list[str | None]


def linear_part(lanes: PlantLanes, controller: Controller) -> LinearPart | None:
    """None for a controller without a linear view."""
    try:
        linear = lanes.linear(controller)
    except NoLinearView:
        return None
    null, moving = linear.null, linear.moving
    stable = null.stable & moving.stable & lanes.null.ok
    ms, gain_margin, phase_margin = (_worse(stable, null, moving, name, pick) for name, pick in _WORSE)
    closed = linear.closed if stable[0] else None
    return LinearPart(stable, ms, gain_margin, phase_margin, linear.curves, closed)


_WORSE = (("ms", np.fmax), ("gain_margin_db", np.fmin), ("phase_margin_deg", np.fmin))


def _worse(stable: np.ndarray, null: LaneMargins, moving: LaneMargins, name: str, pick: np.ufunc) -> np.ndarray:
    return np.where(stable, pick(getattr(null, name), getattr(moving, name)), np.nan)


def step_part(lanes: PlantLanes, controller: Controller, task: LiveTask) -> StepPart:
    """Every rig of the set in the scenario, as `jackbench run` plays it."""
    scenario, rig, period = task.scenario, lanes.rig, lanes.rig.period.value
    t = task.times(period)
    inwards = task.inwards(float(lanes.position[0]), rig.limit("stroke")) if rig.is_jack else 1.0
    asked = inwards * scenario.reference(t)
    play = _in_lanes if graph_law(controller) is not None else _one_by_one
    y, sent, reasons = play(lanes, controller, task, asked, scenario.inputs(t))
    numbers = [_numbers(task, t, inwards * lane, band_of(lanes, task)) for lane in y]
    settling, overshoot, peak = ([row[i] for row in numbers] for i in range(3))
    settling = [None if why else value for value, why in zip(settling, reasons, strict=True)]
    return StepPart(t, asked, y, sent, settling, overshoot, peak, reasons)


LiveLanes = tuple[np.ndarray, np.ndarray, list[str | None]]  # deviations and commands [lanes, k], why each lane tripped
Inputs = Mapping[str, np.ndarray]


def _in_lanes(
    lanes: PlantLanes, controller: Controller, task: LiveTask, asked: np.ndarray, inputs: Inputs
) -> LiveLanes:
    name, null = task.scenario.signal, lanes.null
    played = play_lanes(lanes.engine, lanes.rig, controller, null, lanes.p, asked, (name,), task.seed, inputs)
    ((_, runs),) = played
    start = lanes.engine.outputs(null.x[:, None], null.u[:, None], lanes.p[:, None])[:, 0]
    reasons = [
        SIMULATION_FAILED if failed else trip_reason(lanes.rig, int(trip)) if trip else None if ok else _NOWHERE
        for failed, trip, ok in zip(runs.failed, runs.trip, null.ok, strict=True)
    ]
    return runs.signals[name] - start[:, [lanes.engine.plant.output(name)]], runs.sent, reasons


def _one_by_one(
    lanes: PlantLanes, controller: Controller, task: LiveTask, asked: np.ndarray, inputs: Inputs
) -> LiveLanes:
    """What a controller plays that computes one loop in Python."""
    name, runs = task.scenario.signal, []
    y, sent = np.full((2, len(lanes.p), len(asked)), np.nan)
    for lane, p in enumerate(lanes.p):
        plant = replace(lanes.engine.plant, p=p)
        start = Equilibrium(lanes.null.x[lane], lanes.null.u[lane], 0.0)
        engine = Engine(plant)
        level = float(engine.observe(start.x, start.u)[plant.output(name)])
        there = {key: start.u[plant.input(key)] + values for key, values in inputs.items()}
        run = SampledLoop(engine, lanes.rig, controller, start, task.seed).run(level + asked, there)
        k = len(run.record.t)
        y[lane, :k], sent[lane, :k] = run.record.signals[name] - level, run.record.signals["command"]
        runs.append(run.tripped)
    return y, sent, runs


def band_of(lanes: PlantLanes, task: LiveTask) -> float:
    """In which the controlled signal has settled, SI."""
    return settling_band(lanes.rig, task.scenario.signal, task.scenario.size)


def _numbers(
    task: LiveTask, t: np.ndarray, y: np.ndarray, band: float
) -> tuple[float | None, float | None, float | None]:
    """Settling [s], overshoot [%] and peak deviation of a load [SI], of y [k] from the start."""
    scenario, target = task.scenario, task.scenario.size
    if scenario.arrives is None or not np.all(np.isfinite(y)):
        return None, None, None
    late = t >= scenario.arrives - 1e-9
    settling = metrics.settling_time(t[late], y[late], target, band)
    overshoot = metrics.overshoot(y, float(y[0]), target) if target else None
    peak = metrics.peak_deviation(y[t >= scenario.load_at - 1e-9], target) if scenario.load else None
    return settling, overshoot, peak


def machine_code(lanes: PlantLanes, controller: Controller, task: LiveTask) -> LawShape | None:
    """What decides the machine code of a controller's loop; None for one that computes in Python."""
    law = graph_law(controller)
    if law is None or lanes.engine.back_end != "compiled":
        return None
    sensors = Sensors(lanes.rig, lanes.engine.plant.outputs, task.seed)
    return compiled_law(lanes.engine, lanes.rig, [law], sensors, lanes.p, (task.scenario.signal,)).shape


@dataclass(frozen=True)
class Miss:
    """A number that is out of the goals: on which rig, in which column, which goal, and the number in words."""

    lane: int
    column: str
    goal: str
    value: str = ""


def missed_goals(linear: LinearPart | None, steps: StepPart | None, limits: Limits) -> list[Miss]:
    """What a search would refuse: goals of the linear loops, then those of the motion."""
    misses = []
    if linear is not None:
        misses += [miss for lane in range(len(linear.ms)) for miss in _linear_misses(lane, linear, limits)]
    if steps is not None:
        misses += [miss for lane in range(len(steps.y)) for miss in _step_misses(lane, steps, limits)]
    return misses


def missed_words(names: Sequence[str], misses: Sequence[Miss]) -> list[str]:
    """Goal by goal, on which rigs it is missed."""
    goals = dict.fromkeys(miss.goal for miss in misses)
    return [
        f"{goal}: {', '.join(f'{names[m.lane]} {m.value}'.strip() for m in misses if m.goal == goal)}" for goal in goals
    ]


def within_words(
    names: Sequence[str], linear: LinearPart | None, steps: StepPart | None, limits: Limits
) -> tuple[str, bool]:
    """That no goal is missed: of what and of which rigs, and the largest overshoot where no goal asks for it; whether
    that is all there is to say."""
    judged = [part for part, there in (("linear loops", linear), ("scenario", steps)) if there is not None]
    if not judged:
        return "No goal is judged yet.", False
    where = f"on all {len(names)} rigs" if len(names) > 1 else f"on {names[0]}"
    words = f"Within the goals {where}: {' and '.join(judged)}"
    sizes = {} if steps is None else {size: name for name, size in zip(names, steps.overshoot, strict=True) if size}
    if not sizes or np.isfinite(limits.overshoot_percent):
        return f"{words}.", len(judged) == 2
    return f"{words}; no goal asks for the overshoot, at most {max(sizes):.3g} % ({sizes[max(sizes)]}).", False


def _linear_misses(lane: int, linear: LinearPart, limits: Limits) -> Iterator[Miss]:
    if not linear.stable[lane]:
        yield Miss(lane, "stable", "unstable")
        return
    yield from _beyond(lane, "ms", linear.ms[lane], limits.ms if lane else limits.ms_nominal)
    if not lane:
        yield from _beyond(lane, "gain_margin_db", linear.gain_margin_db[lane], limits.gain_margin_db)


def _step_misses(lane: int, steps: StepPart, limits: Limits) -> Iterator[Miss]:
    if why := steps.tripped[lane]:
        yield Miss(lane, "settling_s", f"trips, {why}")
    yield from _beyond(lane, "overshoot_percent", steps.overshoot[lane], limits.overshoot_percent)


def _beyond(lane: int, key: str, value: float | None, limit: float) -> Iterator[Miss]:
    of = METRICS[key]
    if value is not None and of.beyond(value, limit) > 0:
        yield Miss(lane, key, of.limit_words(limit, missed=True), MetricView().text(value, key))
