"""Faults: every fault in every loop from every moment, and every loop on plants without a fault."""

from collections.abc import Mapping
from typing import Any

from ...control.controller_spec import ControllerSpec
from ...loop.faults import FAULTS
from ...loop.lane_loop import plays_in_lanes
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .config import FaultLoops, FaultsConfig
from .counts import counts
from .fault_free import false_trips
from .page import faults_figure, faults_page
from .played import MOMENTS, Stand


def run_faults(config: FaultsConfig, stage: Stage, progress: Progress) -> Outcome:
    """`rows`: a fault in a loop from a moment, `counts`: what they came to; `calm`: the loops without a fault;
    `false_trips` of those and of `plants`, `trips`: by loop and what tripped it. Two stages a controller."""
    rows: list[dict[str, Any]] = []
    trips: dict[str, Mapping[str, int]] = {}
    left_out: list[str] = []
    for loops in config.loops:
        for spec in loops.controllers:
            progress(f"{spec.name}: {len(FAULTS)} faults")
            rows += stage(spec.name, lambda loops=loops, spec=spec: _rows(config, loops, spec))
            if not plays_in_lanes(spec.build(loops.rig.period.value)):
                left_out.append(spec.name)
                continue
            progress(f"{spec.name} on {config.plants} plants without a fault")
            trips[spec.name] = stage(
                f"{spec.name} without a fault", lambda loops=loops, spec=spec: _trips(config, loops, spec)
            )
    calm = [row for row in rows if row["fault"] == "none"]
    faults = [row for row in rows if row["fault"] != "none"]
    metrics = {
        "rows": faults,
        "counts": counts(faults),
        "calm": calm,
        "false_trips": sum(row["tripped"] is not None for row in calm)
        + sum(sum(each.values()) for each in trips.values()),
        "plants": config.plants,
        "trips": trips,
        "left_out": left_out,
    }
    return Outcome(
        metrics,
        lambda: (faults_page(config, metrics), faults_figure(metrics["rows"])),
        subject=Subject(config.rig, [spec for loops in config.loops for spec in loops.controllers]),
    )


def _rows(config: FaultsConfig, loops: FaultLoops, spec: ControllerSpec) -> list[dict[str, Any]]:
    stand = Stand.of(config, loops, spec)
    faults = [None, *(fault for fault in FAULTS if fault.applies(stand.rig))]
    return [
        {"controller": spec.name, **stand.play(spec.build(stand.rig.period.value), fault, moment)}
        for fault in faults
        for moment in MOMENTS
    ]


def _trips(config: FaultsConfig, loops: FaultLoops, spec: ControllerSpec) -> Mapping[str, int]:
    stand = Stand.of(config, loops, spec)
    return false_trips(config, stand, spec.build(stand.rig.period.value))
