"""Steps of a closed loop: metrics, margins at two operating points, closed-loop Bode linear and by stepped sine."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...control.controller_spec import ControllerSpec
from ...loop.rig_variations import with_delay
from ...loop.rows import LinearLoops, LoopSetup, judge, linear_loops, loop_setup
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...report import Figure, Page, Section, Table
from ..common.design_numbers import Subject
from ..common.fitted_plant import with_fit
from ..common.judged import gas_words, judged_words
from ..common.loop_margins import closed_curves, margins_table, sensitivity_figure, slowed_words
from ..common.metric_table import MetricView
from ..common.outcome import Outcome, Progress, Stage
from ..common.sines import SineResponses, closed_loop_figure, sines
from ..common.step_experiment import StepConfig
from ..common.time_figure import time_figure


def run_steps(config: StepConfig, stage: Stage, progress: Progress) -> Outcome:
    """Every controller in every scenario on the configured rig, with its own computing delay."""
    setup_of = _setups(config)
    rows, runs, loops = [], {}, {}
    for controller in config.controllers:
        progress(f"{controller.name}: margins and steps")
        setup = setup_of(controller)
        loops[controller.name] = linear_loops(controller, setup)
        for scenario in config.scenarios:
            run, row = judge(controller, scenario, setup, loops[controller.name], config.conditions.noise)
            runs[controller.name, scenario.name] = run
            rows.append(row)
    swept = {}
    for controller in config.controllers:
        progress(f"{controller.name}: closed loop by stepped sine")
        swept[controller.name] = stage(
            f"bode-{controller.name}", lambda c=controller: sines(c, config.signal, config.bode, setup_of(c))
        )
    subject = Subject(config.rig, config.controllers)

    def draw() -> tuple[Page, Figure]:
        return step_page(config, rows, runs, loops, swept)

    return Outcome({"rows": rows}, draw, _tables(runs, swept, loops), subject=subject)


def _setups(config: StepConfig) -> Callable[[ControllerSpec], LoopSetup]:
    """The rig with a controller's computing delay: one for all that have the same."""
    late = cache(lambda delay: loop_setup(with_delay(config.rig, delay)))
    return lambda controller: late(config.conditions.delay(controller, config.rig))


def _tables(
    runs: dict[tuple[str, str], LoopRun],
    swept: dict[str, SineResponses],
    loops: dict[str, LinearLoops],
) -> dict[str, dict[str, np.ndarray]]:
    tables = {
        f"step-{controller}-{scenario}": {"t [s]": run.record.t, "demanded [1]": run.demanded, **run.record.signals}
        for (controller, scenario), run in runs.items()
    }
    for controller, pair in loops.items():
        null = pair.null
        if null.closed is not None and null.sensitivity is not None:
            tables[f"linear-{controller}"] = {
                "f_hz": null.f,
                "closed_real": np.real(null.closed),
                "closed_imag": np.imag(null.closed),
                "sensitivity_real": np.real(null.sensitivity),
                "sensitivity_imag": np.imag(null.sensitivity),
            }
    for controller, responses in swept.items():
        tables |= {f"sine-{controller}-{size.replace(' ', '')}": columns for size, columns in responses.items()}
    return tables


def step_page(
    config: StepConfig,
    rows: list[dict[str, Any]],
    runs: dict[tuple[str, str], LoopRun],
    loops: dict[str, LinearLoops],
    sines: dict[str, SineResponses],
) -> tuple[Page, Figure]:
    """The report and its telling figure, from rows of metrics.json, runs by controller and scenario, linear loops and
    sines by controller."""
    figures = {scenario: step_figure(config, scenario, runs, rows) for scenario in config.scenarios}
    page = Page(
        f"{config.signal.name.capitalize()} loops on {config.rig.name}",
        _verdict(config.scenarios, rows) + slowed_words(loops, config.signal),
        [
            Section("Metrics", [_metrics_table(config, rows), margins_table(loops, config.signal)]),
            Section("Time responses", list(figures.values())),
            Section("Closed-loop Bode", [_bode(config, name, loops[name], sines[name]) for name in loops]),
            Section("Sensitivity", [sensitivity_figure(loops)]),
        ],
    )
    return with_fit(page, config.rig), figures[_judged(config.scenarios)]


def _judged(scenarios: Sequence[Scenario]) -> Scenario:
    """The scenario that the verdict is about: the middle one of the steps, or the first where there is none."""
    steps = [scenario for scenario in scenarios if scenario.is_step] or list(scenarios[:1])
    return steps[(len(steps) - 1) // 2]


def _verdict(scenarios: Sequence[Scenario], rows: list[dict[str, Any]]) -> str:
    """Who settles first in the scenario that is judged, or follows a course best, and who is unstable."""
    judged = _judged(scenarios)
    name, compared = judged.name, len({row["controller"] for row in rows}) > 1
    settled = [row for row in rows if row["settling_s"] is not None and row["stable"] is not False]
    bad = sorted({row["controller"] for row in rows if row["stable"] is False})
    unstable = f" Unstable: {', '.join(bad)}." if bad else ""
    able = [row for row in settled if row["scenario"] == name]
    if not able and (followed := [] if judged.is_step else _followed(name, rows)):
        best, signal = min(followed, key=lambda row: row["iae"]), SIGNALS[judged.signal]
        error = float(from_si(best["iae"], signal.unit, signal.si))
        follows = f"{best['controller']} follows{' best' * compared}"
        return f"{name}: {follows}, with an IAE of {error:.3g} {signal.unit} s.{unstable}"
    if not able:
        ends = "settles" if judged.arrives is not None else "goes through it to its end"
        return f"{name}: no stable controller {ends}.{unstable}"
    best = min(able, key=lambda row: row["settling_s"])
    margins = "without margins" if best["ms"] is None else f"at Ms {best['ms']:.2f}"
    return (
        f"{name}: {best['controller']} settles{' first,' * compared} in {best['settling_s']:.3g} s {margins}.{unstable}"
    )


def _followed(name: str, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows of a course that stable loops went through to its end."""
    played = (row for row in rows if row["scenario"] == name and row["stable"] is not False)
    return [row for row in played if row["iae"] is not None and row["tripped"] is None]


def _metrics_table(config: StepConfig, rows: list[dict[str, Any]]) -> Table:
    keys = ("scenario", "controller", "settling_s", "band", "overshoot_percent", "rise_s", "steady_state_error", "iae")
    keys += (
        "peak_command",
        "saturated_s",
        "cavitation_s",
        "residual_oscillation",
        "peak_deviation",
        "stable",
        "tripped",
    )
    note = (
        "Settling into +-band, 2 % of the step or three standard deviations of the sensor, from where reference, "
        f"far end and load stand. {judged_words(config.conditions, config.rig)} Limited: the guard changed the "
        f"command.{gas_words(rows)}"
    )
    note += "".join(f" {remark}" for scenario in config.scenarios for remark in scenario.remarks)
    maker = MetricView.of(config.rig, config.signal, config.scenarios)
    return maker.table("Metrics", rows, keys, note, best=("settling_s", "iae"))


def step_figure(
    config: StepConfig, scenario: Scenario, runs: dict[tuple[str, str], LoopRun], rows: list[dict[str, Any]]
) -> Figure:
    """One scenario under every controller: controlled signal, command, pressures."""
    own = {spec.name: runs[spec.name, scenario.name] for spec in config.controllers}
    return time_figure(scenario.name, config.signal, own, ("command", "pa"), scenario, rows)


def _bode(config: StepConfig, name: str, pair: LinearLoops, swept: SineResponses) -> Figure:
    curves = [replace(curve, style="dash") for curve in closed_curves(pair, config.signal)]
    return closed_loop_figure(name, curves, swept)
