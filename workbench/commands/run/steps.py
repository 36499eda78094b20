"""Steps of a closed loop: metrics, margins at two operating points, closed-loop Bode linear and by stepped sine."""

from collections.abc import Callable
from functools import cache

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...loop.rig_variations import with_delay
from ...loop.rows import LinearLoops, LoopSetup, judge, linear_loops, loop_setup
from ...loop.sampled_loop import LoopRun
from ...report import Figure, Page
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.sines import Sines, sines
from ..common.step_experiment import StepConfig
from .step_page import step_page


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
    swept: dict[str, Sines],
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
