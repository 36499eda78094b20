"""A controller in a scenario on a rig: the run, the linear loop at two operating points, and the row of numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..base.gain_phase import gain_db, phase_deg
from ..base.signals import SIGNALS, Signal
from ..control.controller_spec import ControllerSpec
from ..control.protocol import Controller, NoLinearView
from ..engine import Engine
from ..linear import Equilibrium, equilibrium
from ..linear.crossings import corner_frequency
from ..linear.operating_point import far_end
from ..plant import build
from ..rigs.rig import MOVING, Rig
from . import step_metrics as metrics
from .margins import LinearLoop, Source, linear_loop_on
from .sampled_lanes import SampledLanes, sampled_lane
from .sampled_loop import LoopRun, SampledLoop
from .scenarios import Scenario
from .sensors import check_sensors, settling_band
from .sine_margins import SINE_TOLERANCE, SineTest


def moving_at(signal: Signal, speed: float = MOVING) -> str:
    """The speed of the second operating point, outside the lap's doubled gain, in words, where `signal` is controlled:
    of a position of another kind in its own unit. A specimen's far end moves along."""
    return f"{speed:g} {f'{signal.si}/s' if signal.name == 'position' else SIGNALS['velocity'].si}"


@dataclass(frozen=True)
class LoopSetup:
    """A rig ready to close loops on: its engine, and the points at which loops are linearised."""

    rig: Rig
    engine: Engine
    null: Equilibrium
    null_smooth: Equilibrium
    moving: Equilibrium
    smooth: np.ndarray

    def where(self, scenario: Scenario) -> "LoopSetup":
        """The same at the position at which a scenario starts. Raises InputError where there is no operating point."""
        position = scenario.position(self.rig.limit("stroke"))
        if not position:
            return self
        if position not in self._elsewhere:
            self._elsewhere[position] = _at(self.rig, self.engine, self.smooth, position)
        return self._elsewhere[position]

    @cached_property
    def _elsewhere(self) -> dict[float, "LoopSetup"]:
        return {}

    @cached_property
    def null_plant(self) -> SampledLanes:
        """The plant at null without dry friction, as linear loops of every design have it."""
        return sampled_lane(self.engine.plant, self.null_smooth, self.rig.period.value, self.smooth)

    @cached_property
    def smooth_engine(self) -> Engine:
        """The engine without dry friction, exact enough for small sines."""
        return Engine(replace(self.engine.plant, p=self.smooth), SINE_TOLERANCE)

    @cached_property
    def moving_plant(self) -> SampledLanes:
        """The same moving."""
        return sampled_lane(self.engine.plant, self.moving, self.rig.period.value, self.smooth)


@dataclass(frozen=True)
class LinearLoops:
    """The linear loop at null and moving at `speed` [m/s]."""

    null: LinearLoop
    moving: LinearLoop
    speed: float = MOVING

    @property
    def stable(self) -> bool | None:
        """At both points; None where that is not known."""
        points = (self.null.stable, self.moving.stable)
        return False if False in points else None if None in points else True

    @property
    def margins(self) -> Source:
        """Where the margins come from; none where one of the points has none."""
        return "none" if "none" in (self.null.margins, self.moving.margins) else self.null.margins

    def worst(self, pick: Callable[[Sequence[float]], float], name: str) -> float | None:
        """The worse of the two values of a margin; None for an unstable loop, and where neither has it."""
        values = [value for loop in (self.null, self.moving) if (value := getattr(loop, name)) is not None]
        return pick(values) if values and self.stable else None


def loop_setup(rig: Rig) -> LoopSetup:
    """Build a rig and find its operating points. Raises InputError where there are none."""
    plant = build(rig)
    return _at(rig, Engine(plant), plant.without_dry_friction(), 0.0)


def _at(rig: Rig, engine: Engine, smooth: np.ndarray, position: float) -> LoopSetup:
    """With the operating points at a position [m] from mid stroke, where a specimen is relaxed."""

    def point(p: np.ndarray | None = None, speed: float | None = None) -> Equilibrium:
        far = far_end(engine.plant, position, speed or 0.0)
        return equilibrium(engine.plant, None, speed, position, p, **far)

    return LoopSetup(rig, engine, point(), point(smooth), point(smooth, rig.passing_speed), smooth)


def linear_loops(spec: ControllerSpec, setup: LoopSetup) -> LinearLoops:
    """A controller's loop, linearised at both operating points; tried by sines where it has no linear view.

    Raises InputError where the rig lacks a sensor that the controller needs.
    """
    controller = spec.build(setup.rig.period.value)
    check_sensors(setup.rig, controller.measures)
    try:
        null, moving = (linear_loop_on(plant, controller) for plant in (setup.null_plant, setup.moving_plant))
    except NoLinearView:
        null, moving = (test.loop() for test in _sine_tests(spec, setup))
    return LinearLoops(null, moving, setup.rig.passing_speed)


def _sine_tests(spec: ControllerSpec, setup: LoopSetup) -> tuple[SineTest, SineTest]:
    """At null and moving; there a position changes on the way, and the plant with it."""

    def controller() -> Controller:
        return spec.build(setup.rig.period.value)

    engine, rig = setup.smooth_engine, setup.rig
    return (
        SineTest(engine, rig, controller, setup.null_smooth, speed=0.0, longest=8.0, agree=0.001),
        SineTest(engine, rig, controller, setup.moving, speed=rig.passing_speed, longest=2.0, agree=0.05),
    )


def play(spec: ControllerSpec, scenario: Scenario, setup: LoopSetup, seed: int | None = None) -> LoopRun:
    """A controller in a scenario, from rest where that starts; `seed` is that of the sensors' noise, None without."""
    period, start = setup.rig.period.value, setup.where(scenario).null
    level = float(setup.engine.observe(start.x, start.u)[setup.engine.plant.output(scenario.signal)])
    t = np.arange(round(scenario.duration / period) + 1) * period
    inputs = {name: start.u[setup.engine.plant.input(name)] + moved for name, moved in scenario.inputs(t).items()}
    loop = SampledLoop(setup.engine, setup.rig, spec.build(period), start, seed)
    return loop.run(level + scenario.reference(t), inputs)


def judge(
    spec: ControllerSpec, scenario: Scenario, setup: LoopSetup, loops: LinearLoops, seed: int | None = None
) -> tuple[LoopRun, dict[str, Any]]:
    """What a controller does in a scenario, and its row: with the sensors' noise of a seed, or without.

    `loops` are its `linear_loops` at mid stroke; a scenario that starts elsewhere has its own.
    """
    run = play(spec, scenario, setup, seed)
    calm = run if seed is None else play(spec, scenario, setup)
    there = setup.where(scenario)
    return run, row(spec, scenario, setup, run, loops if there is setup else linear_loops(spec, there), calm)


def row(
    spec: ControllerSpec, scenario: Scenario, setup: LoopSetup, run: LoopRun, loops: LinearLoops, calm: LoopRun
) -> dict[str, Any]:
    """One row of metrics.json: SI but for what its key says. Margins are the worse of null and moving.

    Settling counts from where reference, far end and load stand, into +-`band`: 2 % of the step, but no less than three
    standard deviations of the sensor. A sine has no numbers of a step, a ramp no rise, and only a load a peak
    deviation. The residual oscillation is that of `calm`, the same run without noise, which would pass for hunting.
    """
    signals, t = run.record.signals, run.record.t
    command, band = signals["command"], settling_band(setup.rig, scenario.signal, scenario.size)
    return {
        "controller": spec.name,
        "rig": setup.rig.name,
        "scenario": scenario.name,
        **_step_numbers(scenario, run, band),
        "peak_command": float(np.abs(command).max()),
        "saturated_s": metrics.saturated_time(t, run.demanded, command),
        "cavitation_s": _cavitation(run),
        "residual_oscillation": _residual(scenario, calm),
        "stable": loops.stable,
        "tripped": run.tripped,
        **closed_numbers(loops.null.f, loops.null.closed),
        "gain_margin_db": loops.worst(min, "gain_margin_db"),
        "phase_margin_deg": loops.worst(min, "phase_margin_deg"),
        "ms": loops.worst(max, "ms"),
        "margins": loops.margins,
        "band": band,
        "peak_deviation": _peak(scenario, run),
        "rms_error": _followed(scenario, run),
        **({"slowed": scenario.slowed} if scenario.slowed != 1 else {}),
    }


def closed_numbers(f: np.ndarray, closed: np.ndarray | None) -> dict[str, float | None]:
    """Corners [Hz] and peak [dB] of a closed loop, complex [k] at f [k] Hz; None of an unstable one."""
    if closed is None:
        return dict.fromkeys(("f3db_hz", "f90_hz", "peak_db"))
    gain = gain_db(closed)
    corners = corner_frequency(f, gain, -3.0), corner_frequency(f, phase_deg(closed), -90.0)
    return {"f3db_hz": corners[0], "f90_hz": corners[1], "peak_db": float(gain.max())}


def _step_numbers(scenario: Scenario, run: LoopRun, band: float) -> dict[str, float | None]:
    """Step metrics of the controlled signal."""
    t, y, asked = run.record.t, run.record.signals[scenario.signal], run.record.signals["reference"]
    before, target = float(y[0]), float(y[0] + scenario.size)
    there, stands = run.tripped is None, scenario.arrives
    late = np.flatnonzero(t >= (stands or 0.0) - 1e-9)
    steps = stands is not None and scenario.size != 0
    return {
        "settling_s": metrics.settling_time(t[late], y[late], target, band) if there and stands is not None else None,
        "overshoot_percent": metrics.overshoot(y, before, target) if steps else None,
        "rise_s": metrics.rise_time(t, y, before, target) if scenario.is_step else None,
        "steady_state_error": metrics.steady_state_error(t, y, target) if there and stands is not None else None,
        "iae": metrics.iae(t, y, asked) if there else None,
    }


def _cavitation(run: LoopRun) -> float | None:
    """Time [s] with a chamber below 0 bar; None of a plant without chambers."""
    lowest = run.record.signals.get("lowest_pressure")
    return None if lowest is None else metrics.cavitation_time(run.record.t, lowest)


def _peak(scenario: Scenario, run: LoopRun) -> float | None:
    """How far a load pushes the controlled signal off its target (SI)."""
    if not scenario.load or run.tripped is not None or scenario.arrives is None:
        return None
    t, y = run.record.t, run.record.signals[scenario.signal]
    return metrics.peak_deviation(y[t >= scenario.load_at - 1e-9], float(y[0] + scenario.size))


def _followed(scenario: Scenario, run: LoopRun) -> float | None:
    """Root mean square of what the controlled signal lacks of a reference that moves (SI)."""
    if scenario.is_step or run.tripped is not None:
        return None
    return metrics.rms_error(run.record.signals[scenario.signal], run.record.signals["reference"])


def _residual(scenario: Scenario, run: LoopRun) -> float | None:
    """As a part of the step, or of what a load alone pushes."""
    size = scenario.size or _peak(scenario, run)
    if run.tripped is not None or scenario.arrives is None or not size:
        return None
    return metrics.residual_oscillation(run.record.t, run.record.signals[scenario.signal], size)
