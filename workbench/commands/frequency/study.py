"""Frequency response of a pair of signals, of recordings and of datasheet curves, with that of a rig's model beside."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from ...base.errors import InputError, nearest
from ...base.gain_phase import gain_db, phase_deg
from ...base.signals import DRIVING, SIGNALS
from ...base.units import from_si
from ...engine import Engine
from ...identify.data.frequency_response import FrequencyResponse, measured_response, same_estimate
from ...identify.data.noise_floor import NoiseFloor, noise_floor
from ...identify.fit.predict import predict_free
from ...linear import Equilibrium, discretise, equilibrium
from ...linear.frequency_response import stepped_sine
from ...linear.operating_point import moving_point
from ...linear.state_space import sampled_response
from ...loop.describing_function import closed_loop_sine
from ...loop.drive_simulation import drive
from ...plant import Plant, build, build_pilot_bench, build_valve_bench
from ...records import Record
from ...records.frequency_sheet import FrequencySheet
from ...report import Figure, Page
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .config import FrequencyTask
from .page import Comparison, columns, figure, page, rows

BENCHES: Mapping[str, Callable[[Rig], Plant]] = {"command": build_valve_bench, "current": build_pilot_bench}
"""Where the sheet of an input is measured: ports at 35 bar, lands fed at 70 bar, as maker's curves are."""


def run_frequency(task: FrequencyTask, stage: Stage, progress: Progress) -> Outcome:
    """Measured and model responses of every record and sheet, with coherence and 95 % bands."""
    rig, comparisons = task.rig, []
    assert rig is not None
    if task.campaign is not None:
        plant, floor = build(rig), noise_floor(task.campaign)
        for record in task.records:
            progress(f"{record.name}: {task.pair[1]} over {task.pair[0]}")
            measured = measured_response(record, *task.pair, task.period)
            compute = partial(_predicted, plant, record, floor, measured)
            model = stage(f"model-{record.name.replace('/', '-')}", compute)["response"]
            comparisons.append(_of_record(rig, record, measured, np.asarray(model)))
    for sheet in task.sheets:
        progress(f"{sheet.name}: stepped sine")
        model = stage(f"sheet-{sheet.name}", partial(_sine, rig, sheet))["response"]
        comparisons.append(_of_sheet(sheet, np.asarray(model)))
    tables = {f"response-{comparison.name.replace('/', '-')}": columns(comparison) for comparison in comparisons}
    metrics = {"rows": [row for comparison in comparisons for row in rows(comparison)]}

    def draw() -> tuple[Page, Figure]:
        return page(task.source, rig.name, comparisons), figure(comparisons[0])

    return Outcome(metrics, draw, tables, {}, Subject(rig))


def _predicted(plant: Plant, record: Record, floor: NoiseFloor, measured: FrequencyResponse) -> dict[str, np.ndarray]:
    """The model's response [k] by the same estimator on what it predicts of the record; NaN where it fails."""
    for name in (measured.input, measured.output):
        if name not in plant.outputs and name not in DRIVING:
            raise InputError(f"rig {plant.name} does not predict {name}; {nearest(name, plant.outputs)}")
    free = predict_free(plant, record, floor)
    signals = {name: values for name, values in record.signals.items() if name in DRIVING} | free.signals
    if free.failed:
        return {"response": np.full(measured.f.size, complex(np.nan, np.nan))}
    return {"response": same_estimate(measured, Record(record.name, record.t, signals))}


def _of_record(rig: Rig, record: Record, measured: FrequencyResponse, model: np.ndarray) -> Comparison:
    pair, notes = (measured.input, measured.output), list(measured.notes)
    if measured.instrument.any():
        lines, last = measured.instrument.sum(), measured.f[measured.instrument].max()
        notes.append(f"closed loop: the reference is the instrument at {lines} lines, the last at {last:.3g} Hz")
    if not np.isfinite(model).any():
        notes.append("the model fails in a run through the whole record")
    factor = _factor(pair)
    linear = _linear(rig, pair, measured.f, record.period)
    return Comparison(
        record.name,
        pair,
        measured.f,
        measured.response * factor,
        model * factor,
        measured.method,
        measured.coherence,
        measured.radius * factor,
        {name: response * factor for name, response in linear.items()},
        tuple(notes),
    )


def _linear(rig: Rig, pair: tuple[str, str], f: np.ndarray, period: float) -> dict[str, np.ndarray]:
    """Linear models of the pair, sampled and held as the record is; none where the controller would be needed."""
    if pair[0] == "reference":
        return {}
    plant = build(rig)
    smooth = plant.without_dry_friction()
    curves = {}
    moving, passing = moving_point(plant, rig.passing_speed, p=smooth)
    points = {"linear, null": equilibrium(plant, speed=0.0, p=smooth), f"linear, {passing:g} m/s": moving}
    for name, about in points.items():
        below, above = (_held(plant, about, signal, smooth, f, period) for signal in pair)
        curves[name] = above / np.where(below == 0, np.nan, below)
    return curves


def _held(plant: Plant, about: Equilibrium, signal: str, p: np.ndarray, f: np.ndarray, period: float) -> np.ndarray:
    """Response [k] of a signal to the held command at the samples."""
    if signal == "command":
        return np.ones(f.size, dtype=complex)
    return sampled_response(discretise(plant, about, period, (signal,), p), np.exp(2j * np.pi * f * period))[0, 0]


def _sine(rig: Rig, sheet: FrequencySheet) -> dict[str, np.ndarray]:
    """The response [k] of the nonlinear model to sines of the sheet's amplitude, where the sheet was measured."""
    if sheet.input == "reference" and sheet.output == "position":
        response = _closed_loop(rig, sheet)
    elif sheet.input in BENCHES:
        plant = BENCHES[sheet.input](rig)
        if sheet.output not in plant.outputs:
            known = nearest(sheet.output, plant.outputs)
            raise InputError(f"sheet {sheet.name}: the bench of {plant.name} gives no {sheet.output}; {known}")
        rest = equilibrium(plant, command=0.0, p=plant.without_dry_friction())
        sine = stepped_sine(Engine(plant), rest.x, rest.u, sheet.f, sheet.amplitude, [sheet.output])
        response = sine.response[sheet.output]
    else:
        pairs = "command or current to a signal of the valve, or reference to position"
        raise InputError(f"sheet {sheet.name}: {sheet.input} to {sheet.output} is measured on no bench; take {pairs}")
    return {"response": response / response[0] if sheet.relative else response}


def _closed_loop(rig: Rig, sheet: FrequencySheet) -> np.ndarray:
    """reference -> position in the position loop of `record`, on straight lines between whole samples a cycle."""
    ready, period = drive(rig), rig.period.value
    cycles = 1 / (sheet.f * period)
    samples = np.unique(np.concatenate((np.floor(cycles), np.ceil(cycles))).astype(int))[::-1]
    f = 1 / (samples * period)
    start = equilibrium(ready.engine.plant)
    sine = closed_loop_sine(ready.engine, rig, lambda: ready.loop.build(period), start, f, sheet.amplitude)
    response = sine.response["position"]
    gain, phase = (np.interp(np.log(sheet.f), np.log(f), part(response)) for part in (gain_db, phase_deg))
    return 10 ** (gain / 20) * np.exp(1j * np.radians(phase))


def _of_sheet(sheet: FrequencySheet, model: np.ndarray) -> Comparison:
    pair, signal = (sheet.input, sheet.output), SIGNALS[sheet.input]
    factor = 1.0 if sheet.relative else _factor(pair)
    how = f"sines of {float(from_si(sheet.amplitude, signal.unit, signal.si)):g} {signal.unit}"
    notes = ["gains are referred to the lowest frequency"] if sheet.relative else []
    if sheet.input == "reference":
        notes.append("the model's loop is the position loop of `jackbench record`")
    return Comparison(sheet.name, pair, sheet.f, sheet.response * factor, model * factor, how, notes=tuple(notes))


def _factor(pair: tuple[str, str]) -> float:
    """From SI of output over input to the units that people read."""
    below, above = (
        float(from_si(1.0, signal.unit, signal.si) - from_si(0.0, signal.unit, signal.si))
        for signal in (SIGNALS[name] for name in pair)
    )
    return above / below
