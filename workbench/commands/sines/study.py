"""Sines by every controller: alone, with amplitude and phase control, and with the harmonics taken out."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.words import counted
from ...control.controller_spec import ControllerSpec
from ...control.protocol import graph_law
from ...loop.metrics import chamber_row
from ...loop.rig_variations import with_delay
from ...loop.rows import LinearLoops, LoopSetup, linear_loops, loop_setup
from ...loop.sampled_loop import SampledLoop
from ...loop.sines import amplitude_phase, arriving, cycles_to_arrive, sine, sine_errors
from ...loop.step_metrics import saturated_time
from ...report import Figure, Page
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .options import Sine, SinesConfig
from .page import WAYS, page, picture
from .plants import SinePlants, plants_row, sine_plants, sines_on_plants

ALONE, APC, AHC = WAYS  # amplitude and phase control; adaptive harmonic cancellation besides


def run_sines(config: SinesConfig, stage: Stage, progress: Progress) -> Outcome:
    """`rows`: on the rigs; `plants`: on the drawn plants, with all that is corrected; `reach`: what valves give."""
    weakest = config.weakest
    highest = {name: each.sine_frequency(config.amplitude) for name, each in config.reach.items()}
    progress(f"{1e3 * config.amplitude:g} mm up to {highest[weakest]:.3g} Hz, where the valve of {weakest} saturates")
    rows, drawn, left_out, tables = [], [], [], {}
    for spec in config.controllers:
        rigs = {name: with_delay(rig, config.conditions.delay(spec, rig)) for name, rig in config.rigs.items()}
        setups = {name: loop_setup(rig) for name, rig in rigs.items()}
        loops = _loops(spec, setups)
        for name, setup in setups.items():
            progress(f"{spec.name} on {name}")
            rows += stage(f"{spec.name} {name}", partial(_rig_rows, config, spec, loops, name, setup))
        if not config.plants:
            continue
        if graph_law(_with_sines(config, spec, loops, config.sines[0], AHC).build(config.rig.period.value)) is None:
            left_out.append(spec.name)
            continue
        on_plants, columns = _drawn(config, spec, loops, stage, progress)
        drawn += on_plants
        tables |= columns
    metrics = {
        "rows": rows,
        "plants": drawn,
        "left_out": left_out,
        "reach": [{"rig": name, "amplitude": config.amplitude, "highest_hz": f} for name, f in highest.items()],
    }
    subject = Subject(config.rig, config.controllers, config.rigs)

    def draw() -> tuple[Page, Figure]:
        figure = picture(config, metrics)
        return page(config, metrics, figure), figure

    return Outcome(metrics, draw, tables, subject=subject)


def _loops(spec: ControllerSpec, setups: Mapping[str, LoopSetup]) -> LinearLoops:
    """The linear loops on the first rig. Raises InputError where they tell nothing of sines."""
    name, setup = next(iter(setups.items()))
    loops = linear_loops(spec, setup)
    if loops.null.closed is None or loops.moving.closed is None:
        raise InputError(f"{spec.name}: no linear stable loop on {name}, where correction starts; choose another")
    return loops


def _with_sines(config: SinesConfig, spec: ControllerSpec, loops: LinearLoops, asked: Sine, way: str) -> ControllerSpec:
    """The controller as it follows a sine in one of the three ways."""
    if way == ALONE:
        return spec
    sensor = config.rig.sensors.get("position")
    highest = config.harmonics if way == AHC else 1
    return amplitude_phase(spec, loops, asked.frequency, highest, sensor.noise if sensor else 0.0)


def _ways(config: SinesConfig) -> tuple[str, ...]:
    return (ALONE, APC, AHC) if config.harmonics > 1 else (ALONE, APC)


def _rig_rows(
    config: SinesConfig, spec: ControllerSpec, loops: LinearLoops, name: str, setup: LoopSetup
) -> list[dict[str, Any]]:
    """Rows of a controller on a rig: a sine and a way each."""
    return [
        {"controller": spec.name, "rig": name, "way": way}
        | _row(config, _with_sines(config, spec, loops, asked, way), setup, asked)
        for asked in config.sines
        for way in _ways(config)
    ]


def _row(config: SinesConfig, spec: ControllerSpec, setup: LoopSetup, asked: Sine) -> dict[str, Any]:
    """What the true position did with noise; SI but for what keys say, None where the guard tripped."""
    period = setup.rig.period.value
    reference = sine(asked.amplitude, asked.frequency, period)
    loop = SampledLoop(setup.engine, setup.rig, spec.build(period), setup.null, config.conditions.noise)
    start = float(setup.engine.observe(setup.null.x, setup.null.u)[setup.engine.plant.output("position")])
    run = loop.run(start + reference)
    signals, arrived = run.record.signals, run.tripped is None
    y = signals["position"] - start
    row: dict[str, Any] = {"frequency": asked.frequency, "amplitude": asked.amplitude}
    if arrived:
        errors = sine_errors(y[None], asked.amplitude, asked.frequency, period)
        row |= {
            "amplitude_error_percent": float(100 * errors.amplitude[0]),
            "phase_error_deg": float(np.degrees(errors.phase[0])),
            "third_db": float(20 * np.log10(errors.third[0])),
            "within": bool(errors.within[0]),
            "cycles": cycles_to_arrive(*arriving(y, asked.amplitude, asked.frequency, period)),
        }
    else:
        row |= dict.fromkeys(("amplitude_error_percent", "phase_error_deg", "third_db", "cycles")) | {"within": False}
    return row | {
        "peak_command": float(np.abs(signals["command"]).max()),
        "saturated_s": saturated_time(run.record.t, run.demanded, signals["command"]),
        "lowest_pressure": float(signals["lowest_pressure"].min()),
        **chamber_row(run.record.t, signals["lowest_pressure"]),
        "tripped": run.tripped,
    }


def _drawn(
    config: SinesConfig, spec: ControllerSpec, loops: LinearLoops, stage: Stage, progress: Progress
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Rows of a controller on the drawn plants, a sine each, and the columns of each."""
    plants = sine_plants(config, with_delay(config.rig, config.conditions.delay(spec, config.rig)))
    way, rows, tables = _ways(config)[-1], [], {}
    for asked in config.sines:
        progress(f"{spec.name} on {counted(config.plants, 'plant')}, {asked.frequency:g} Hz")
        compute = partial(_columns, config, plants, _with_sines(config, spec, loops, asked, way), asked)
        columns = stage(f"{spec.name} plants {asked.frequency:g} Hz", compute)
        rows.append({"controller": spec.name, "way": way} | plants_row(plants, asked, columns))
        tables[f"plants_{spec.name}_{asked.frequency:g}_hz".replace("-", "_").replace(".", "_")] = columns
    return rows, tables


def _columns(config: SinesConfig, plants: SinePlants, spec: ControllerSpec, asked: Sine) -> dict[str, Any]:
    return sines_on_plants(config, plants, spec.build(config.rig.period.value), asked)
