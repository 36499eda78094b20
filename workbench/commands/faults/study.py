"""Faults: every fault in every loop from every moment, and every loop on plants without a fault."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...base.words import counted
from ...control.controller_spec import ControllerSpec
from ...control.protocol import graph_law
from ...loop.fault_trial import MOMENTS, FaultLoops, FaultTrial, FaultTrials, counts, harmful, helpless
from ...loop.faults import FAULTS
from ...rigs.shut_off import closing_in
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .fault_free import false_trips, tripped
from .page import faults_figure, faults_page

CLOSING = (0.01, 0.02, 0.05)  # s: of the shut-off valves that are tried


def run_faults(trials: FaultTrials, stage: Stage, progress: Progress) -> Outcome:
    """`rows`: a fault in a loop from a moment, `counts`: what they came to; `calm`: the loops without a fault;
    `false_trips` of those and of `plants`, `trips`: by loop and what tripped it. Two stages a controller."""
    rows: list[dict[str, Any]] = []
    trips: dict[str, Mapping[str, int]] = {}
    left_out: list[str] = []
    shut: list[dict[str, Any]] = []
    for loops in trials.loops:
        for spec in loops.controllers:
            progress(f"{spec.name}: {len(FAULTS)} faults")
            own = stage(spec.name, lambda loops=loops, spec=spec: _rows(trials, loops, spec))
            rows += own
            if lost := [row for row in own if helpless(row)]:
                progress(f"{spec.name}: {len(lost)} of a stuck valve again, with shut-off valves")
                shut += stage(
                    f"{spec.name} with shut-off valves",
                    lambda loops=loops, spec=spec, lost=lost: _shut(trials, loops, spec, lost),
                )
            if graph_law(spec.build(loops.rig.period.value)) is None:
                left_out.append(spec.name)
                continue
            progress(f"{spec.name} on {counted(trials.plants, 'plant')} without a fault")
            trips[spec.name] = stage(
                f"{spec.name} without a fault", lambda loops=loops, spec=spec: _trips(trials, loops, spec)
            )
    calm = [row for row in rows if row["fault"] == "none"]
    faults = [row for row in rows if row["fault"] != "none"]
    metrics = {
        "rows": faults,
        "counts": counts(faults),
        "shut_off": [_saved(shut, closing) for closing in CLOSING],
        "calm": calm,
        "false_trips": sum(row["tripped"] is not None for row in calm) + sum(map(tripped, trips.values())),
        "plants": trials.plants,
        "trips": trips,
        "left_out": left_out,
    }
    return Outcome(
        metrics,
        lambda: (faults_page(trials, metrics), faults_figure(metrics["rows"])),
        subject=Subject(trials.rig, [spec for loops in trials.loops for spec in loops.controllers]),
    )


def _rows(trials: FaultTrials, loops: FaultLoops, spec: ControllerSpec) -> list[dict[str, Any]]:
    trial = FaultTrial.of(trials, loops, spec)
    faults = [None, *(fault for fault in FAULTS if fault.applies(trial.rig))]
    return [
        {"controller": spec.name, **trial.play(spec.build(trial.rig.period.value), fault, moment)}
        for fault in faults
        for moment in MOMENTS
    ]


def _shut(
    trials: FaultTrials, loops: FaultLoops, spec: ControllerSpec, lost: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """The faults of `lost` rows again, on the rig with a shut-off valve of each closing time."""
    faults = {fault.name: fault for fault in FAULTS}
    rows = []
    for closing in CLOSING:
        rig = replace(loops.rig, shut_off=closing_in(closing))
        trial = FaultTrial.of(trials, replace(loops, rig=rig), spec)
        for row in lost:
            controller = spec.build(trial.rig.period.value)
            played = trial.play(controller, faults[row["fault"]], row["moment"])
            rows.append({"controller": spec.name, "closing": closing, **played})
    return rows


def _saved(rows: Sequence[Mapping[str, Any]], closing: float) -> dict[str, Any]:
    """What a closing time saves: of so many faults that did harm without, how many still do, and the worst of them."""
    own = [row for row in rows if row["closing"] == closing]
    worst = {key: max((row[key] for row in own), default=0.0) for key in ("stop_speed", "peak_force", "beyond_percent")}
    return {"closing_ms": 1e3 * closing, "of": len(own), "harm": sum(map(harmful, own)), **worst}


def _trips(trials: FaultTrials, loops: FaultLoops, spec: ControllerSpec) -> Mapping[str, int]:
    trial = FaultTrial.of(trials, loops, spec)
    return false_trips(trials, trial, spec.build(trial.rig.period.value))
