"""An inverse before a loop: designed on some rigs, judged on all, by linear loops and by playing the record."""

from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...loop.designed_inverse import ReferenceInverse, designed_inverse, outer_loop
from ...loop.learning import Iteration, rms
from ...loop.margins import LinearLoop
from ...loop.rows import LinearLoops, LoopSetup, linear_loops
from ...report import Figure, Page
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .drawn import drawn_errors, drawn_rows, drawn_section
from .options import InverseConfig
from .page import Inverted, drive_file, left_figure, page, tables

Loops = Mapping[str, LinearLoops]


def run_inverse(config: InverseConfig, stage: Stage, progress: Progress) -> Outcome:
    """For each controller the inverse of its loops on `over`; the record with and without it, and the outer loop."""
    record = config
    inverted = {spec.name: _inverted(config, spec, stage, progress) for spec in record.controllers}
    drawn = {name: each.drawn for name, each in inverted.items() if each.drawn is not None}
    metrics = {
        "rows": [row for name, each in inverted.items() for row in _rows(name, record.reference, each.runs)],
        "outer": [row for name, each in inverted.items() for row in _outer_rows(name, each)],
        "plants": drawn_rows(config, drawn),
    }
    files = {name: text for each in inverted.values() for name, text in drive_file(config, each).items()}
    subject = Subject(record.rig, record.controllers, record.rigs)

    def draw() -> tuple[Page, Figure]:
        more = [drawn_section(config, drawn)] if drawn else []
        return page(config, inverted, metrics, more), left_figure(next(iter(inverted.values())))

    return Outcome(metrics, draw, tables(config, inverted), files, subject)


def _inverted(config: InverseConfig, spec: ControllerSpec, stage: Stage, progress: Progress) -> Inverted:
    """The inverse of one controller's loops, and what it does."""
    setups = config.setups(spec)
    loops = {name: linear_loops(spec, setup) for name, setup in setups.items()}
    inverse = _designed(config, spec, loops)
    runs = {}
    for name, setup in setups.items():
        progress(f"{spec.name}, {name}: with and without the inverse")
        runs[name] = _played(config, spec, name, setup, inverse, stage)
    outers = {name: _outers(config, spec, setup, inverse) for name, setup in setups.items()} if config.outer else {}
    return Inverted(spec.name, inverse, loops, runs, outers, drawn_errors(config, spec, inverse, stage, progress))


def _designed(config: InverseConfig, spec: ControllerSpec, loops: Loops) -> ReferenceInverse:
    """At null and moving. Raises InputError for a loop that is unstable on one of the rigs."""
    both = {f"{name}, {point}": getattr(loops[name], point) for name in loops for point in ("null", "moving")}
    for where, loop in both.items():
        if loop.closed is None:
            raise InputError(f"{spec.name}: no linear stable loop on {where}; choose another")
    designed = [both[f"{name}, {point}"] for name in config.designed_on for point in ("null", "moving")]
    return designed_inverse(designed, config.rig.period.value, config.preview, config.taps, config.band)


def _played(
    config: InverseConfig, spec: ControllerSpec, name: str, setup: LoopSetup, inverse: ReferenceInverse, stage: Stage
) -> dict[str, Iteration]:
    """The record as it is and filtered, with the same noise."""
    repeated, reference = config.repeated(spec, setup), config.reference
    drives = {"as it is": reference, "inverse": inverse.filtered(reference)}

    def play(drive: np.ndarray) -> dict[str, Any]:
        return asdict(repeated.play(0, drive, 1.0))

    return {how: Iteration(**stage(f"{spec.name} {name}-{how}", partial(play, drive))) for how, drive in drives.items()}


def _rows(controller: str, reference: np.ndarray, runs: Mapping[str, Mapping[str, Iteration]]) -> list[dict[str, Any]]:
    """A row a rig; errors are true ones, SI."""
    rows = []
    for name, run in runs.items():
        without, filtered = (rms(reference[: len(each.true)] - each.true) for each in run.values())
        rows.append({
            "controller": controller,
            "rig": name,
            "error_rms": without,
            "error_rms_inverse": filtered,
            "factor": without / filtered,
            "peak_command": float(np.abs(run["inverse"].command).max()),
            **run["inverse"].chambers,
            "tripped": run["inverse"].tripped,
        })  # fmt: skip
    return rows


def _outers(
    config: InverseConfig, spec: ControllerSpec, setup: LoopSetup, inverse: ReferenceInverse
) -> dict[tuple[str, str], LinearLoop]:
    """The outer loop by operating point, without and with the inverse."""
    assert config.outer is not None
    controller = spec.build(config.rig.period.value)
    plants = {"null": setup.null_plant, "moving": setup.moving_plant}
    return {
        (point, how): outer_loop(plant, controller, config.outer, before)
        for point, plant in plants.items()
        for how, before in (("as it is", None), ("inverse", inverse))
    }


def _outer_rows(controller: str, inverted: Inverted) -> list[dict[str, Any]]:
    """A row a rig, operating point and reference, with the margins of the inner loop there."""
    return [
        {
            "controller": controller,
            "rig": name,
            "point": point,
            "reference": how,
            "stable": loop.stable,
            "ms": loop.ms,
            "gain_margin_db": loop.gain_margin_db,
            "phase_margin_deg": loop.phase_margin_deg,
            "inner_ms": getattr(inverted.loops[name], point).ms,
            "inner_gain_margin_db": getattr(inverted.loops[name], point).gain_margin_db,
        }
        for name, each in inverted.outers.items()
        for (point, how), loop in each.items()
    ]
