"""Designs on drawn plants that no search has seen: as many as a search draws, by the next seed."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...base.checkpoint import Stage
from ...base.numbers import finite, quantile
from ...loop.envelope import EnvelopeSteps, steps
from ...loop.hard_goals import largest_ms
from ...loop.tuning.goals import tuning_envelope
from ...loop.tuning.problem import TuneProblem

Row = dict[str, Any]


def unseen_rows(problem: TuneProblem, designs: Mapping[str, Mapping[str, float]], stage: Stage) -> list[Row]:
    """Designs, searched numbers by name, in every scenario with noise; none where the problem draws no plants."""
    if not problem.factors:
        return []
    rows = (stage(f"unseen-{name}", lambda values=values: _rows(problem, values)) for name, values in designs.items())
    return [{"design": name, **row} for name, own in zip(designs, rows, strict=True) for row in own]


def _rows(problem: TuneProblem, values: Mapping[str, float]) -> list[Row]:
    lanes = tuning_envelope(replace(problem, seed=problem.seed + 1)).drawn
    assert lanes is not None  # for the problem has factors
    controller = problem.design(values).build(problem.rig.period.value)
    ms = largest_ms(lanes, controller)
    noise, limits = problem.conditions.noise, problem.limits
    linear = {"plants": len(ms), "unstable": int(np.isinf(ms).sum()), "ms_worst": finite(ms.max())}
    rows = []
    for scenario in problem.scenarios:
        motion = steps(lanes, controller, scenario, noise, limits.seconds, limits.moves)
        rows.append({"scenario": scenario.name, **linear, **_motion(motion, bool(scenario.size))})
    return rows


def _motion(motion: EnvelopeSteps, is_step: bool) -> Row:
    """A plant that never settles counts as the slowest."""
    row: Row = {"tripped": int(motion.tripped.sum()), "iae_mean": finite(motion.iae.mean())}
    settling = np.where(np.isnan(motion.settling), np.inf, motion.settling)
    shares = {"p50": 0.5, "p99": 0.99, "worst": 1.0}
    row |= {f"settling_{name}_s": quantile(settling, share) if is_step else None for name, share in shares.items()}
    return {**row, "overshoot_worst_percent": finite(motion.overshoot.max()) if is_step else None}
