"""Steps of a closed loop: metrics, margins at two operating points, closed-loop Bode linear and by stepped sine."""

import numpy as np

from ...loop.rows import LinearLoops, linear_loops, loop_setup, play, row
from ...loop.sampled_loop import LoopRun
from ..common.outcome import Outcome, Progress, Stage
from ..common.sines import Sines, sines
from ..common.step_experiment import StepConfig
from .step_page import step_figure, step_page


def run_steps(config: StepConfig, stage: Stage, progress: Progress) -> Outcome:
    """Every controller in every scenario on the configured rig."""
    on = loop_setup(config.rig)
    rows, runs, loops = [], {}, {}
    for chosen in config.controllers:
        progress(f"{chosen.name}: margins and steps")
        loops[chosen.name] = linear_loops(chosen, on)
        for wanted in config.scenarios:
            runs[chosen.name, wanted.name] = run = play(chosen, wanted, on)
            rows.append(row(chosen, wanted, on, run, loops[chosen.name]))
    swept = {}
    for chosen in config.controllers:
        progress(f"{chosen.name}: closed loop by stepped sine")
        swept[chosen.name] = stage(f"bode-{chosen.name}", lambda c=chosen: sines(c, config.signal, config.bode, on))
    page = step_page(config, rows, runs, loops, swept)
    telling = [wanted for wanted in config.scenarios if wanted.is_step] or config.scenarios
    return Outcome({"rows": rows}, page, step_figure(config, telling[-1], runs), _tables(runs, swept, loops))


def _tables(
    runs: dict[tuple[str, str], LoopRun],
    swept: dict[str, Sines],
    loops: dict[str, LinearLoops],
) -> dict[str, dict[str, np.ndarray]]:
    tables = {
        f"step-{controller}-{wanted}": {"t [s]": run.record.t, "demanded [1]": run.demanded, **run.record.signals}
        for (controller, wanted), run in runs.items()
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
    for controller, found in swept.items():
        tables |= {f"sine-{controller}-{size.replace(' ', '')}": columns for size, columns in found.items()}
    return tables
