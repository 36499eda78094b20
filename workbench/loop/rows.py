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
from ..linear.operating_point import far_end, moving_point
from ..plant import build
from ..rigs.rig import MOVING, Rig
from .margins import LinearLoop, Source, linear_loop_on
from .metrics import JudgedRun
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
    """A rig ready to close loops on: its engine, and the points at which loops are linearised, at null and moving at
    `speed` [m/s]."""

    rig: Rig
    engine: Engine
    null: Equilibrium
    null_smooth: Equilibrium
    moving: Equilibrium
    speed: float
    smooth: np.ndarray

    def where(self, scenario: Scenario) -> "LoopSetup":
        """This setup at the position where a scenario starts. Raises InputError where there is no operating point."""
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
        """The moving plant without dry friction, as linear loops of every design have it."""
        return sampled_lane(self.engine.plant, self.moving, self.rig.period.value, self.smooth)


@dataclass(frozen=True)
class LinearLoops:
    """The linear loop at null and moving at `speed` [m/s], which is less than was `asked` where the drive gives no
    more."""

    null: LinearLoop
    moving: LinearLoop
    speed: float = MOVING
    asked: float = MOVING

    @property
    def stable(self) -> bool | None:
        """At both points; None where that is not known."""
        points = (self.null.stable, self.moving.stable)
        return False if False in points else None if None in points else True

    @property
    def margins(self) -> Source:
        """The source of the margins, "none" where one of the points has none."""
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

    def null(p: np.ndarray | None = None) -> Equilibrium:
        return equilibrium(engine.plant, None, None, position, p, **far_end(engine.plant, position))

    moving = moving_point(engine.plant, rig.passing_speed, position, smooth)
    return LoopSetup(rig, engine, null(), null(smooth), *moving, smooth)


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
    return LinearLoops(null, moving, setup.speed, setup.rig.passing_speed)


def _sine_tests(spec: ControllerSpec, setup: LoopSetup) -> tuple[SineTest, SineTest]:
    """At null and moving; there a position changes on the way, and the plant with it."""

    def controller() -> Controller:
        return spec.build(setup.rig.period.value)

    engine, rig = setup.smooth_engine, setup.rig
    return (
        SineTest(engine, rig, controller, setup.null_smooth, speed=0.0, longest=8.0, agree=0.001),
        SineTest(engine, rig, controller, setup.moving, speed=setup.speed, longest=2.0, agree=0.05),
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

    The settling band is 2 % of the step, but no less than three standard deviations of the sensor. The residual
    oscillation is that of `calm`, the same run without noise.
    """
    worst: tuple[tuple[str, Callable[[Sequence[float]], float]], ...] = (
        ("gain_margin_db", min),
        ("phase_margin_deg", min),
        ("ms", max),
    )
    linear = {"stable": loops.stable, "margins": loops.margins, **closed_numbers(loops.null.f, loops.null.closed)}
    linear |= {name: loops.worst(pick, name) for name, pick in worst}
    band = settling_band(setup.rig, scenario.signal, scenario.size)
    judged = _judged(scenario, run, band, linear)
    return {
        "controller": spec.name,
        "rig": setup.rig.name,
        "scenario": scenario.name,
        **replace(judged, calm=_judged(scenario, calm, band, linear)).row(),
        **({"slowed": scenario.slowed} if scenario.slowed != 1 else {}),
    }


def linear_row(loop: LinearLoop) -> dict[str, Any]:
    """The metrics of a linear loop at one operating point, by key."""
    names = ("stable", "ms", "gain_margin_db", "phase_margin_deg", "margins")
    return {name: getattr(loop, name) for name in names} | closed_numbers(loop.f, loop.closed)


def closed_numbers(f: np.ndarray, closed: np.ndarray | None) -> dict[str, float | None]:
    """Corners [Hz] and peak [dB] of a closed loop, complex [k] at f [k] Hz; None of an unstable one."""
    if closed is None:
        return dict.fromkeys(("f3db_hz", "f90_hz", "peak_db"))
    gain = gain_db(closed)
    corners = corner_frequency(f, gain, -3.0), corner_frequency(f, phase_deg(closed), -90.0)
    return {"f3db_hz": corners[0], "f90_hz": corners[1], "peak_db": float(gain.max())}


def _judged(scenario: Scenario, run: LoopRun, band: float, linear: dict[str, Any]) -> JudgedRun:
    """A run as metrics read it. A sine has no target, a ramp no rise, and only a load pushes."""
    signals, y, stands = run.record.signals, run.record.signals[scenario.signal], scenario.arrives
    return JudgedRun(
        t=run.record.t,
        y=y,
        reference=signals["reference"],
        before=float(y[0]),
        target=float(y[0] + scenario.size),
        size=scenario.size,
        band=band,
        commands=signals["command"],
        demanded=run.demanded,
        realised=signals["command"],
        lowest_pressure=signals.get("lowest_pressure"),
        tripped=run.tripped,
        linear=linear,
        stands=stands,
        steps=stands is not None and scenario.size != 0,
        jumps=scenario.is_step,
        pushed=scenario.load_at if scenario.load else None,
    )


def spread_over_rigs(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One line for each controller and scenario of `rows` (as `rows.row` gives them, one a rig).

    Least and most settling time [s], overshoot [percent], peak deviation [SI] and Ms [1], None where no rig has it, and
    the names of the rigs on which the loop does not settle or is unstable.
    """
    lines = []
    for controller, scenario in dict.fromkeys((row["controller"], row["scenario"]) for row in rows):
        played = [row for row in rows if (row["controller"], row["scenario"]) == (controller, scenario)]
        line: dict[str, Any] = {"controller": controller, "scenario": scenario}
        for key in ("settling_s", "overshoot_percent", "peak_deviation", "ms"):
            values = [row[key] for row in played if row[key] is not None]
            line |= {f"{key}_least": min(values, default=None), f"{key}_most": max(values, default=None)}
        line["unsettled"] = [row["rig"] for row in played if row["settling_s"] is None]
        line["unstable"] = [row["rig"] for row in played if row["stable"] is False]
        lines.append(line)
    return lines
