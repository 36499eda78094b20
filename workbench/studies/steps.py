"""Steps of a closed loop: metrics, margins at two operating points, closed-loop Bode linear and by stepped sine."""

import numpy as np

from ..config import StepConfig
from ..loop import LoopRun
from ..loop_response import closed_loop_sine, sampled_frequencies
from ..recipe import Recipe
from ..units import from_si
from .loop_rows import Bench, LinearLoops, bench, linear_loops, play, row
from .outcome import Outcome, Progress, Stage
from .step_page import Sines, step_figure, step_page


def run_steps(config: StepConfig, stage: Stage, progress: Progress) -> Outcome:
    """Every controller in every scenario on the configured rig."""
    on = bench(config.rig)
    rows, runs, loops = [], {}, {}
    for chosen in config.controllers:
        progress(f"{chosen.name}: margins and steps")
        loops[chosen.name] = linear_loops(chosen, on)
        for wanted in config.scenarios:
            runs[chosen.name, wanted.name] = run = play(chosen, wanted, on)
            rows.append(row(chosen, wanted, on, run, loops[chosen.name]))
    sines = {c.name: stage(f"bode-{c.name}", lambda c=c: _sines(config, c, on, progress)) for c in config.controllers}
    page = step_page(config, rows, runs, loops, sines)
    telling = [wanted for wanted in config.scenarios if wanted.is_step] or config.scenarios
    return Outcome({"rows": rows}, page, step_figure(config, telling[-1], runs), _tables(runs, sines, loops))


def _sines(config: StepConfig, chosen: Recipe, on: Bench, progress: Progress) -> Sines:
    """Closed-loop stepped sine at each amplitude, as columns."""
    period, signal = config.rig.period.value, config.signal
    f = sampled_frequencies(config.bode.low, config.bode.high, config.bode.points, period)
    found = {}
    for amplitude in config.bode.amplitudes:
        size = f"{float(from_si(amplitude, signal.unit, signal.si)):g} {signal.unit}"
        progress(f"{chosen.name}: stepped sine of {size}")
        sine = closed_loop_sine(on.engine, config.rig, lambda: chosen.make(period), on.null, f, amplitude)
        response = sine.response[signal.name]
        found[size] = {
            "f_hz": sine.f,
            "real": np.real(response),
            "imag": np.imag(response),
            "settled": sine.settled,
            "saturated": sine.saturated,
            "cavitated": sine.cavitated,
        }
    return found


def _tables(
    runs: dict[tuple[str, str], LoopRun],
    sines: dict[str, Sines],
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
    for controller, found in sines.items():
        tables |= {f"sine-{controller}-{size.replace(' ', '')}": columns for size, columns in found.items()}
    return tables
