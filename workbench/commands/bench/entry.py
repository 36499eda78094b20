"""One controller on one rig of a bench: rows, courses, linear loop, stiffness, noise, energy and compute times."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...loop.compute_time import computing
from ...loop.margins import LinearLoop
from ...loop.rig_variations import with_delay
from ...loop.rows import LoopSetup, linear_loops, loop_setup, play, row
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...loop.stiffness_and_noise import command_noise, dynamic_stiffness
from ...plant.valve.supply import supply_power
from ...rigs.rig import Rig
from ..common.bench_experiment import BenchLoop
from ..common.sines import sines

BenchmarkEntry = dict[str, Any]  # what a stage can store
STIFFNESS_HZ = np.geomspace(0.1, 100.0, 961)  # fine enough for a mode of damping 0.02
_STEADY = 0.1  # s: over which a force error is a mean


def benchmark_entry(chosen: ControllerSpec, loop: BenchLoop, on: LoopSetup) -> BenchmarkEntry:
    """All that a bench tells of a controller on a rig, to be stored as a stage."""
    loops = linear_loops(chosen, on)
    runs = {wanted.name: (wanted, play(chosen, wanted, on)) for wanted in loop.scenarios}
    pair = {"controller": chosen.name, "rig": on.rig.name}
    computed = {name: computing(chosen, on.rig, run) for name, (_, run) in runs.items()}
    first = on.rig.name == loop.rigs[0]
    stiffness = np.abs(dynamic_stiffness(chosen, on, STIFFNESS_HZ)) if loops.null.stable else None
    return {
        "rows": [row(chosen, wanted, on, run, loops) for wanted, run in runs.values()],
        "courses": {name: _course(wanted, run) for name, (wanted, run) in runs.items()},
        "linear": _linear(loops.null),
        "stiffness": stiffness,
        "sines": sines(chosen, loop.signal, loop.bode, on) if first else {},
        "delayed": _delayed(chosen, loop, on) if first and chosen.computing_delay else [],
        "fallbacks": [
            {**pair, "scenario": name, "samples": len(spent), "fallbacks": count}
            for name, (spent, count) in computed.items()
            if count is not None
        ],
        "noise": {**pair, "command_rms": command_noise(chosen, on, loops.null)},
        "energy": [{**pair, "scenario": name, **_energy(on.rig, run)} for name, (_, run) in runs.items()],
        "moving": [
            {**pair, "scenario": name, "speed": wanted.speed, "error_n_per_m_s": error_per_speed(wanted, run)}
            for name, (wanted, run) in runs.items()
            if wanted.travel
        ],
        "solve_us": np.concatenate([spent for spent, _ in computed.values()]),
    }


def _delayed(chosen: ControllerSpec, loop: BenchLoop, on: LoopSetup) -> list[dict[str, Any]]:
    """Rows of the loop whose commands come late by what the controller computes; again where it can expect that."""
    there = loop_setup(with_delay(on.rig, chosen.computing_delay))
    expecting = chosen.expecting_its_delay()
    found = []
    for known, one in ((False, chosen), *([] if expecting == chosen else [(True, expecting)])):
        loops = linear_loops(one, there)
        for wanted in loop.scenarios:
            numbers = row(one, wanted, there, play(one, wanted, there), loops)
            found.append({**numbers, "computing_delay_s": chosen.computing_delay, "expected": known})
    return found


def error_per_speed(wanted: Scenario, run: LoopRun) -> float | None:
    """Force error [N] that a far end at constant speed adds, over that speed [m/s]; None for a loop that tripped."""
    if run.tripped is not None:
        return None
    t, signals = run.record.t, run.record.signals
    speed = wanted.inputs(t)["specimen_velocity"]
    leaves, slows = t[np.flatnonzero(speed > 0)[0]], t[np.flatnonzero(speed > 0.999 * wanted.speed)[-1]]
    error = signals["reference"] - signals["force"]
    standing, moving = (np.mean(error[(t > end - _STEADY) & (t < end)]) for end in (leaves, slows))
    return float((moving - standing) / wanted.speed)


def _course(wanted: Scenario, run: LoopRun) -> dict[str, np.ndarray]:
    """The columns of a course that are kept."""
    names = ("reference", wanted.signal, "command", "pa", "pb")
    return {"t [s]": run.record.t, **{name: run.record.signals[name] for name in names}}


def _linear(loop: LinearLoop) -> dict[str, np.ndarray] | None:
    """The columns of a stable linear loop."""
    if loop.closed is None or loop.sensitivity is None:
        return None
    columns = {"open": loop.open, "closed": loop.closed, "sensitivity": loop.sensitivity}
    parts = {"real": np.real, "imag": np.imag}
    return {"f_hz": loop.f} | {f"{n}_{p}": take(v) for n, v in columns.items() for p, take in parts.items()}


def _energy(rig: Rig, run: LoopRun) -> dict[str, float]:
    """Energy [J] that the main lands took from the supply over the run, and its part beyond the leakage at rest."""
    signals: Mapping[str, np.ndarray] = run.record.signals
    power = supply_power(rig, *(signals[name] for name in ("spool", "pa", "pb", "supply")))
    taken = float(np.trapezoid(power, run.record.t))
    return {"energy_j": taken, "beyond_rest_j": taken - float(power[0] * (run.record.t[-1] - run.record.t[0]))}
