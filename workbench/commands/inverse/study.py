"""An inverse before a loop: designed on some rigs, judged on all, by linear loops and by playing the record."""

from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...loop.designed_inverse import ReferenceInverse, designed_inverse
from ...loop.learning import Iteration, rms
from ...loop.margins import LinearLoop
from ...loop.outer_loop import outer_loop
from ...loop.rows import LinearLoops, LoopSetup, linear_loops
from ..common.outcome import Outcome, Progress, Stage
from .config import InverseConfig
from .page import Inverted, drive_file, page, pictures, table

Loops = Mapping[str, LinearLoops]


def run_inverse(config: InverseConfig, stage: Stage, progress: Progress) -> Outcome:
    """The inverse of the loops on `over`; the record with and without it, and the outer loop, on every rig."""
    record, setups = config.record, config.record.setups()
    loops = {name: linear_loops(record.controller, setup) for name, setup in setups.items()}
    inverse = _designed(config, loops)
    runs = {}
    for name, setup in setups.items():
        progress(f"{name}: with and without the inverse")
        runs[name] = _played(config, name, setup, inverse, stage)
    outers = {name: _outers(config, setup, inverse) for name, setup in setups.items()} if config.outer else {}
    inverted = Inverted(inverse, loops, runs, outers)
    metrics = {"rows": _rows(record.reference, runs), "outer": _outer_rows(outers, loops)}
    shown = pictures(config, inverted)
    return Outcome(
        metrics, page(config, inverted, metrics, shown), shown[0], table(inverse), drive_file(config, inverse)
    )


def _designed(config: InverseConfig, loops: Loops) -> ReferenceInverse:
    """At null and moving. Raises InputError for a loop that is unstable on one of the rigs."""
    both = {f"{name}, {point}": getattr(loops[name], point) for name in loops for point in ("null", "moving")}
    for where, loop in both.items():
        if loop.closed is None:
            raise InputError(f"{config.record.controller.name}: no linear stable loop on {where}; choose another")
    designed = [both[f"{name}, {point}"] for name in config.over for point in ("null", "moving")]
    return designed_inverse(designed, config.record.rig.period.value, config.preview, config.taps, config.band)


def _played(
    config: InverseConfig, name: str, setup: LoopSetup, inverse: ReferenceInverse, stage: Stage
) -> dict[str, Iteration]:
    """The record as it is and filtered, with the same noise."""
    repeated, reference = config.record.repeated(setup), config.record.reference
    drives = {"as it is": reference, "inverse": inverse.filtered(reference)}

    def play(drive: np.ndarray) -> dict[str, Any]:
        return asdict(repeated.play(0, drive, 1.0))

    return {how: Iteration(**stage(f"{name}-{how}", partial(play, drive))) for how, drive in drives.items()}


def _rows(reference: np.ndarray, runs: Mapping[str, Mapping[str, Iteration]]) -> list[dict[str, Any]]:
    """A row a rig; errors are true ones, SI."""
    rows = []
    for name, run in runs.items():
        without, filtered = (rms(reference[: len(each.true)] - each.true) for each in run.values())
        rows.append({
            "rig": name,
            "error_rms": without,
            "error_rms_inverse": filtered,
            "factor": without / filtered,
            "peak_command": float(np.abs(run["inverse"].command).max()),
            "tripped": run["inverse"].tripped,
        })  # fmt: skip
    return rows


def _outers(config: InverseConfig, setup: LoopSetup, inverse: ReferenceInverse) -> dict[tuple[str, str], LinearLoop]:
    """The outer loop by operating point, without and with the inverse."""
    assert config.outer is not None
    controller = config.record.controller.build(config.record.rig.period.value)
    plants = {"null": setup.null_plant, "moving": setup.moving_plant}
    return {
        (point, how): outer_loop(plant, controller, config.outer, before)
        for point, plant in plants.items()
        for how, before in (("as it is", None), ("inverse", inverse))
    }


def _outer_rows(outers: Mapping[str, Mapping[tuple[str, str], LinearLoop]], loops: Loops) -> list[dict[str, Any]]:
    """A row a rig, operating point and reference, with the margins of the inner loop there."""
    return [
        {
            "rig": name,
            "point": point,
            "reference": how,
            "stable": loop.stable,
            "ms": loop.ms,
            "gain_margin_db": loop.gain_margin_db,
            "phase_margin_deg": loop.phase_margin_deg,
            "inner_ms": getattr(loops[name], point).ms,
            "inner_gain_margin_db": getattr(loops[name], point).gain_margin_db,
        }
        for name, each in outers.items()
        for (point, how), loop in each.items()
    ]
