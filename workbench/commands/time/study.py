"""How long controllers take to compute, and the experiment with that as the computing delay of each of them."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from ...base.process_pool import one_blas_thread
from ...base.toml_text import toml_text
from ...control.controller_spec import ControllerSpec
from ...loop.rows import loop_setup, play
from ...loop.run_numbers import computing, summary
from ...loop.scenarios import Scenario
from ...report import Curve, Figure, Mark, Page, Panel, Section, Table
from ...rigs.rig import Rig
from ...rigs.rig_file import bundled as bundled_rigs, rig_text
from ..common.bench_experiment import BenchConfig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.step_experiment import StepConfig

Loops = Sequence[tuple[Rig, Sequence[ControllerSpec], Sequence[Scenario]]]


def run_timing(config: StepConfig | BenchConfig, rig_name: str, stage: Stage, progress: Progress) -> Outcome:
    """Play every controller in every scenario on the nominal rig, then again to the controller alone, with a clock.

    Leaves timed.toml, the experiment in which each controller has the 99th percentile as its computing delay.
    """
    with one_blas_thread():
        spent = {name: times for loop in _loops(config) for name, times in _measured(loop, stage, progress).items()}
    period = config.rig.period.value
    timing = {name: summary(times, period) for name, times in spent.items()}

    def draw() -> tuple[Page, Figure]:
        return _page(config, timing, spent), _figure(spent, period)

    return Outcome({"controllers": list(spent), "timing": timing}, draw, {}, {
        "timed.toml": _timed(config.source, timing, rig_name if rig_name in bundled_rigs() else "rig.toml"),
        **({} if rig_name in bundled_rigs() else {"rig.toml": rig_text(config.rig)}),
    }, Subject(config.rig, [spec for _, controllers, _ in _loops(config) for spec in controllers]))  # fmt: skip


def _loops(config: StepConfig | BenchConfig) -> Loops:
    if isinstance(config, StepConfig):
        return [(config.rig, config.controllers, config.scenarios)]
    return [(loop.rig, loop.controllers, loop.scenarios) for loop in config.loops]


def _measured(loop: tuple[Rig, Sequence[ControllerSpec], Sequence[Scenario]], stage: Stage, progress: Progress) -> Any:
    rig, controllers, scenarios = loop
    setup, times = loop_setup(rig), {}
    for controller in controllers:
        progress(controller.name)

        def played(controller: ControllerSpec = controller) -> np.ndarray:
            return np.concatenate(
                [computing(controller, rig, play(controller, scenario, setup)) for scenario in scenarios]
            )

        times[controller.name] = stage(controller.name, played)
    return times


def _timed(source: Mapping[str, Any], timing: Mapping[str, Mapping[str, float]], rig: str) -> str:
    """The experiment, on a rig by name, with the delay of each controller."""
    table = {**{key: part for key, part in deepcopy(dict(source)).items() if key != "plant"}, "rig": rig}
    for name, percentiles in timing.items():
        table["controllers"][name]["computing_delay"] = {"value": round(percentiles["solve_p99_us"], 1), "unit": "us"}
    return "# Computing delays: the 99th percentile of each controller, on the machine that measured.\n" + toml_text(
        table
    )


def _page(
    config: StepConfig | BenchConfig, timing: Mapping[str, Mapping[str, float]], spent: Mapping[str, np.ndarray]
) -> Page:
    period = config.rig.period.value
    slowest = max(timing, key=lambda name: timing[name]["solve_p99_us"])
    share = timing[slowest]["solve_p99_us"] / (period * 1e6)
    table = Table(
        "Computing times",
        ["controller", "median [us]", "99 % [us]", "99 % of the period [%]", "longer than the period", "samples"],
        [
            [name, t["solve_p50_us"], t["solve_p99_us"], t["solve_p99_us"] / period / 1e4, t["late"], len(spent[name])]
            for name, t in timing.items()
        ],
        note="Measured on this machine, in one process, in Python. timed.toml beside this report has the 99th "
        "percentiles as computing delays, with which `run`, `bench` and `tune` judge instead of the rig's.",
        best={"median [us]": "min", "99 % [us]": "min"},
    )
    verdict = (
        f"{slowest} takes longest: 99 % of its samples within {timing[slowest]['solve_p99_us']:.3g} us, "
        f"{100 * share:.2g} % of the control period of {period * 1e3:g} ms."
    )
    return Page(f"Computing times on {config.rig.name}", verdict, [Section("Times", [table, _figure(spent, period)])])


def _figure(spent: Mapping[str, np.ndarray], period: float) -> Figure:
    part = np.linspace(0.0, 99.9, 400)
    curves = [Curve(name, np.percentile(times, part), part) for name, times in spent.items()]
    panel = Panel("samples done [%]", curves, marks=(Mark(period * 1e6, "control period", "x"),))
    return Figure("Samples done within a time", "time [us]", [panel], log_x=True, height=420)
