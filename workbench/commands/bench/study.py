"""A bench: controllers x rigs x scenarios, each controller on a rig a stage, and what follows from all of them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.process_pool import Jobs, process_pool
from ...control.automatic_tuning import READ
from ...control.controller_spec import ControllerSpec
from ...loop.automatic import self_tuning, tuned_on
from ...loop.envelope_row import EnvelopeEntry, envelope_entry, envelope_of, has_envelope
from ...loop.limit import limits_by_name, times_limit
from ...loop.rig_variations import with_delay
from ...loop.rows import LoopSetup, loop_setup, spread_over_rigs
from ...loop.run_numbers import summary
from ...loop.tracking_limit import tracking_limits_by_name
from ...report import Figure, Page
from ..common.bench_experiment import BenchConfig, BenchLoop
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .entry import STIFFNESS_HZ, BenchmarkEntry, Entries, benchmark_entry
from .page import bench_page, bench_picture

_MARKS_HZ = (0.1, 1.0, 10.0, 100.0)


def run_bench(config: BenchConfig, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """Every controller on every rig in every scenario of its signal, by the workers of `jobs`."""
    keys = [(i, c.name, rig) for i, loop in enumerate(config.loops) for rig in loop.rigs for c in loop.controllers]
    with process_pool(jobs, partial(_benchmark, config)) as played:
        items = {f"{name} on {rig}": (i, name, rig) for i, name, rig in keys}
        results = played(items, stage, lambda entry: progress("{controller} on {rig}".format(**entry["noise"])))
    envelopes = _over_the_envelope(config, stage, progress, jobs)
    by_rig = {(name, rig): entry for (_, name, rig), entry in zip(keys, results, strict=True)}
    entries: Entries = {
        (c.name, rig): by_rig[c.name, rig] for loop in config.loops for c in loop.controllers for rig in loop.rigs
    }
    entries = _beside_limits(config, entries, stage)
    rows = [row for entry in entries.values() for row in entry["rows"]]
    metrics = {
        "rows": rows,
        "stiffness": [_stiffness(key, entry["stiffness"]) for key, entry in entries.items()],
        "noise": [entry["noise"] for entry in entries.values()],
        "energy": [row for entry in entries.values() for row in entry["energy"]],
        "moving_end": [row for entry in entries.values() for row in entry["moving"]],
        "spread": spread_over_rigs(rows),
        "fallbacks": [row for entry in entries.values() for row in entry["fallbacks"]],
        "timing": _timing(config, entries),
        "envelope": [entry["row"] for entry in envelopes],
    }
    controllers = [spec for loop in config.loops for spec in loop.controllers]
    rigs = {name: rig for loop in config.loops for name, rig in loop.rigs.items()}
    subject = Subject(config.rig, controllers, rigs)

    def draw() -> tuple[Page, Figure]:
        clouds = {entry["row"]["controller"]: entry["cloud"] for entry in envelopes}
        return bench_page(config, entries, clouds, metrics), bench_picture(config, entries, metrics)

    return Outcome(metrics, draw, _tables(entries), subject=subject)


def run_whole_bench(config: BenchConfig, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """The bench, with the automatic controller beside its own."""
    return run_bench(beside_automatic(config, progress), stage, progress, jobs)


def beside_automatic(config: BenchConfig, progress: Progress) -> BenchConfig:
    """With the controller that small moves on the first rig of the set give by rules, named "automatic", in every
    position loop that has none of that name: what any other has to beat, judged on the same plants. A rig on which it
    cannot be had goes without."""
    taken = {spec.name for loop in config.loops for spec in loop.controllers}
    loops = []
    for loop in config.loops:
        own = loop
        able = all(rig.is_jack and {*READ} <= rig.sensors.keys() for rig in loop.rigs.values())
        if able and "automatic" not in taken and loop.signal.name == "position" and has_envelope(loop.scenarios):
            try:
                moving, rig = self_tuning(loop.rigs[loop.first]), loop.rigs[loop.first]
                setup = loop_setup(with_delay(rig, config.conditions.delay(moving, rig)))
                spec = tuned_on(moving, setup, config.conditions.noise)
                own = replace(loop, controllers=(*loop.controllers, spec))
            except InputError as error:
                progress(f"no automatic controller beside the others: {error}")
        loops.append(own)
    return replace(config, loops=tuple(loops))


def _beside_limits(config: BenchConfig, entries: Entries, stage: Stage) -> Entries:
    """The entries whose rows say how many times the limit of the nominal rig their settling is, or their error."""
    found = {
        name: limit
        for loop in config.loops
        for name, limit in stage(f"limits {loop.signal.name}", partial(_limits, loop)).items()
    }
    return {
        key: {**entry, "rows": [_beside_limit(row, found[row["scenario"]]) for row in entry["rows"]]}
        for key, entry in entries.items()
    }


def _limits(loop: BenchLoop) -> dict[str, float | None]:
    """Limits by scenario: times [s] of steps, errors (SI) of references that move."""
    steps = [scenario for scenario in loop.scenarios if scenario.is_step]
    moving = [scenario for scenario in loop.scenarios if not scenario.is_step]
    return limits_by_name(loop.rig, steps) | tracking_limits_by_name(loop.rig, moving)


def _beside_limit(row: dict[str, Any], limit: float | None) -> dict[str, Any]:
    reached = row["settling_s"] if row["rms_error"] is None else row["rms_error"]
    return row | {"times_limit": times_limit(reached, limit)}


def _benchmark(config: BenchConfig) -> Callable[[tuple[int, str, str]], BenchmarkEntry]:
    """The work of one process: a loop's number, a controller and a rig, which it builds once for a computing delay."""

    @cache
    def setup(i: int, rig: str, delay: float) -> LoopSetup:
        return loop_setup(with_delay(config.loops[i].rigs[rig], delay))

    def work(item: tuple[int, str, str]) -> BenchmarkEntry:
        i, name, rig = item
        loop = config.loops[i]
        controller = next(spec for spec in loop.controllers if spec.name == name)
        delay = config.conditions.delay(controller, loop.rigs[rig])
        return benchmark_entry(controller, loop, setup(i, rig, delay), config.conditions.noise)

    return work


def _over_the_envelope(config: BenchConfig, stage: Stage, progress: Progress, jobs: Jobs) -> list[EnvelopeEntry]:
    """An entry for every controller that has a linear view, by the workers of `jobs`."""
    judged = [(i, loop) for i, loop in enumerate(config.loops) if has_envelope(loop.scenarios)]
    items = {f"{spec.name} over the envelope": (i, spec) for i, loop in judged for spec in loop.controllers}

    def done(entry: EnvelopeEntry | None) -> None:
        if entry:
            progress("{controller} over the envelope".format(**entry["row"]))

    with process_pool(jobs, partial(_envelope_entries, config)) as judge:
        entries = judge(items, stage, done)
    return [entry for entry in entries if entry]


def _envelope_entries(config: BenchConfig) -> Callable[[tuple[int, ControllerSpec]], EnvelopeEntry | None]:
    """The work of one process: a loop's number and a controller on the envelope, built once for a computing delay."""
    space = cache(lambda i, delay: envelope_of(config.loops[i].rigs, delay))

    def work(item: tuple[int, ControllerSpec]) -> EnvelopeEntry | None:
        i, spec = item
        loop = config.loops[i]
        delay = config.conditions.delay(spec, loop.rigs[loop.first])
        return envelope_entry(spec, space(i, delay), loop.rigs, loop.scenarios, config.conditions.noise)

    return work


def _stiffness(key: tuple[str, str], size: np.ndarray | None) -> dict[str, Any]:
    """The frequency at which a loop gives way most, and its stiffness at a few frequencies, N/m."""
    named = dict(zip(("controller", "rig"), key, strict=True))
    if size is None:
        return {**named, "least": None, "least_hz": None, **{f"at_{f:g}hz": None for f in _MARKS_HZ}}
    least = int(np.argmin(size))
    marks = np.exp(np.interp(np.log(_MARKS_HZ), np.log(STIFFNESS_HZ), np.log(size)))
    at = {f"at_{f:g}hz": value for f, value in zip(_MARKS_HZ, marks, strict=True)}
    return {**named, "least": size[least], "least_hz": STIFFNESS_HZ[least], **at}


def _timing(config: BenchConfig, entries: Entries) -> dict[str, dict[str, float | int]]:
    """How long a controller computes in a sample, over the runs in which that was measured."""
    timing = {}
    for controller in dict.fromkeys(name for name, _ in entries):
        spent = np.concatenate([entry["solve_us"] for (name, _), entry in entries.items() if name == controller])
        timing[controller] = summary(spent, config.rig.period.value)
    return timing


def _tables(entries: Entries) -> dict[str, dict[str, np.ndarray]]:
    tables = {}
    for (controller, rig), entry in entries.items():
        end = f"{controller}-{rig}"
        tables |= {f"step-{end}-{name}": columns for name, columns in entry["courses"].items()}
        if entry["linear"] is not None:
            tables[f"linear-{end}"] = entry["linear"]
        tables |= {f"sine-{end}-{size.replace(' ', '')}": columns for size, columns in entry["sines"].items()}
        if entry["stiffness"] is not None:
            tables[f"stiffness-{end}"] = {"f_hz": STIFFNESS_HZ, "n_per_m": entry["stiffness"]}
    return tables
