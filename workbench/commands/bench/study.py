"""A bench: controllers x rigs x scenarios, each controller on a rig a stage, and what follows from all of them."""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from ...base.process_pool import process_pool
from ...loop.compute_time import summary
from ...loop.rig_spread import spread_over_rigs
from ...loop.rig_variations import variation
from ...loop.rows import LoopSetup, loop_setup
from ..common.bench_experiment import BenchConfig
from ..common.outcome import Outcome, Progress, Stage
from .entry import STIFFNESS_HZ, BenchmarkEntry, benchmark_entry
from .page import bench_page, bench_picture

Cells = dict[tuple[str, str], BenchmarkEntry]  # by controller and rig
_MARKS_HZ = (0.1, 1.0, 10.0, 100.0)


def run_bench(config: BenchConfig, stage: Stage, progress: Progress, jobs: int = 1) -> Outcome:
    """Every controller on every rig in every scenario of its signal, by `jobs` processes."""
    keys = [(i, c.name, rig) for i, loop in enumerate(config.loops) for rig in loop.rigs for c in loop.controllers]
    with process_pool(jobs, partial(_cells, config)) as played:
        items = {f"{name} on {rig}": (i, name, rig) for i, name, rig in keys}
        found = played(items, stage, lambda one: progress("{controller} on {rig}".format(**one["noise"])))
    by_rig = {(name, rig): one for (_, name, rig), one in zip(keys, found, strict=True)}
    cells: Cells = {
        (c.name, rig): by_rig[c.name, rig] for loop in config.loops for c in loop.controllers for rig in loop.rigs
    }
    rows = [row for found in cells.values() for row in found["rows"]]
    metrics = {
        "rows": rows,
        "stiffness": [_stiffness(key, found["stiffness"]) for key, found in cells.items()],
        "noise": [found["noise"] for found in cells.values()],
        "energy": [one for found in cells.values() for one in found["energy"]],
        "moving_end": [one for found in cells.values() for one in found["moving"]],
        "spread": spread_over_rigs(rows),
        "delayed": [one for found in cells.values() for one in found["delayed"]],
        "fallbacks": [one for found in cells.values() for one in found["fallbacks"]],
        "timing": _timing(config, cells),
    }
    page = bench_page(config, cells, metrics)
    return Outcome(metrics, page, bench_picture(config, cells), _tables(cells))


def _cells(config: BenchConfig) -> Callable[[tuple[int, str, str]], BenchmarkEntry]:
    """The work of one process: a loop's number, a controller and a rig, which it builds once."""

    @cache
    def on(i: int, rig: str) -> LoopSetup:
        return loop_setup(variation(config.loops[i].rig, rig))

    def work(item: tuple[int, str, str]) -> BenchmarkEntry:
        i, name, rig = item
        loop = config.loops[i]
        chosen = next(one for one in loop.controllers if one.name == name)
        return benchmark_entry(chosen, loop, on(i, rig))

    return work


def _stiffness(key: tuple[str, str], size: np.ndarray | None) -> dict[str, Any]:
    """Where a loop gives way most, and how stiff it is at a few frequencies, N/m."""
    named = dict(zip(("controller", "rig"), key, strict=True))
    if size is None:
        return {**named, "least": None, "least_hz": None, **{f"at_{f:g}hz": None for f in _MARKS_HZ}}
    least = int(np.argmin(size))
    marks = np.exp(np.interp(np.log(_MARKS_HZ), np.log(STIFFNESS_HZ), np.log(size)))
    at = {f"at_{f:g}hz": value for f, value in zip(_MARKS_HZ, marks, strict=True)}
    return {**named, "least": size[least], "least_hz": STIFFNESS_HZ[least], **at}


def _timing(config: BenchConfig, cells: Cells) -> dict[str, dict[str, float | int]]:
    """What a controller computes in a sample, over all its courses."""
    found = {}
    for controller in dict.fromkeys(name for name, _ in cells):
        spent = np.concatenate([one["solve_us"] for (name, _), one in cells.items() if name == controller])
        found[controller] = summary(spent, config.rig.period.value)
    return found


def _tables(cells: Cells) -> dict[str, dict[str, np.ndarray]]:
    tables = {}
    for (controller, rig), found in cells.items():
        end = f"{controller}-{rig}"
        tables |= {f"step-{end}-{name}": columns for name, columns in found["courses"].items()}
        if found["linear"] is not None:
            tables[f"linear-{end}"] = found["linear"]
        tables |= {f"sine-{end}-{size.replace(' ', '')}": columns for size, columns in found["sines"].items()}
        if found["stiffness"] is not None:
            tables[f"stiffness-{end}"] = {"f_hz": STIFFNESS_HZ, "n_per_m": found["stiffness"]}
    return tables
