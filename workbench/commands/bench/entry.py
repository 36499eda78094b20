"""One controller on one rig of a bench: rows, time responses, linear loop, stiffness, noise, energy, compute times."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...loop.margins import LinearLoop
from ...loop.rows import LoopSetup, judge, linear_loops
from ...loop.run_numbers import computing, error_per_speed, supply_energy
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...loop.stiffness_and_noise import command_noise, dynamic_stiffness
from ...rigs.rig import Rig
from ..common.bench_experiment import BenchLoop
from ..common.sines import sines

BenchmarkEntry = dict[str, Any]  # what a stage can store
Entries = Mapping[tuple[str, str], BenchmarkEntry]  # by controller and rig
STIFFNESS_HZ = np.geomspace(0.1, 100.0, 961)  # fine enough for a mode of damping 0.02


def benchmark_entry(controller: ControllerSpec, loop: BenchLoop, setup: LoopSetup, seed: int | None) -> BenchmarkEntry:
    """Every number and curve of a controller on a rig, to be stored as a stage; `seed` of the sensors' noise, or None.

    A law that runs compiled is timed on the first rig only: it computes the same on every other one.
    """
    loops = linear_loops(controller, setup)
    judged = [judge(controller, scenario, setup, loops, seed) for scenario in loop.scenarios]
    runs = {scenario.name: (scenario, run) for scenario, (run, _) in zip(loop.scenarios, judged, strict=True)}
    pair = {"controller": controller.name, "rig": setup.rig.name}
    first = setup.rig.name == loop.first
    linear = setup.rig.takes_load and loops.null.stable and loops.null.margins == "linear"
    stiffness = np.abs(dynamic_stiffness(controller, setup, STIFFNESS_HZ)) if linear else None
    return {
        "rows": [row for _, row in judged],
        "courses": {name: _time_response(scenario, run) for name, (scenario, run) in runs.items()},
        "linear": _linear(loops.null),
        "stiffness": stiffness,
        "sines": sines(controller, loop.signal, loop.bode, setup) if first else {},
        "fallbacks": [
            {**pair, "scenario": name, "samples": len(run.record.t), "fallbacks": run.fallbacks}
            for name, (_, run) in runs.items()
            if run.fallbacks is not None
        ],
        "noise": {**pair, "command_rms": command_noise(controller, setup, loops.null)},
        "energy": [
            {**pair, "scenario": name, **asdict(supply_energy(setup.rig, run))} for name, (_, run) in runs.items()
        ],
        "moving": [
            {**pair, "scenario": name, "speed": scenario.speed, "error_n_per_m_s": error_per_speed(scenario, run)}
            for name, (scenario, run) in runs.items()
            if scenario.travel
        ],
        "solve_us": _compute_us(controller, setup.rig, [run for _, run in runs.values()], first),
    }


def _compute_us(controller: ControllerSpec, rig: Rig, runs: Sequence[LoopRun], first: bool) -> np.ndarray:
    """Compute times [k]: a law that runs compiled takes no longer on one rig than on another."""
    timed = [run for run in runs if first or run.compute_us is not None]
    return np.concatenate([np.zeros(0), *(computing(controller, rig, run) for run in timed)])


def _time_response(scenario: Scenario, run: LoopRun) -> dict[str, np.ndarray]:
    """The columns of a run that are stored."""
    names = ("reference", scenario.signal, "command", "pa", "pb")
    return {"t [s]": run.record.t, **{name: run.record.signals[name] for name in names if name in run.record.signals}}


def _linear(loop: LinearLoop) -> dict[str, np.ndarray] | None:
    """The columns of a stable linear loop."""
    if loop.closed is None or loop.sensitivity is None:
        return None
    columns = {"open": loop.open, "closed": loop.closed, "sensitivity": loop.sensitivity}
    parts = {"real": np.real, "imag": np.imag}
    return {"f_hz": loop.f} | {f"{n}_{p}": take(v) for n, v in columns.items() for p, take in parts.items()}
