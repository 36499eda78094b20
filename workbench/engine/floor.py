"""The arithmetic floor of the batch kernel: the time of its divisions and square roots alone, at this core's own rate.

Everything else in an attempt can overlap with them; a kernel that needed nothing but its divisions and roots would take
this long.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import casadi as ca
import numpy as np

from ..plant import Plant
from .compiled import CompiledPlant
from .jobs import Stepping
from .rosenbrock import adaptive_attempt
from .tape import divide_less, fixed, read

_TERMS = 16
_ROWS = 4000
_REPEATS = 7


@dataclass(frozen=True)
class KernelTimeBound:
    """Divisions and roots of one attempt of one lane, and their measured times on one core [s]."""

    divisions: int
    roots: int
    division_s: float
    root_s: float

    @property
    def attempt_s(self) -> float:
        """Least time of an attempt of one lane on one core [s]."""
        return self.divisions * self.division_s + self.roots * self.root_s


def kernel_time_bound(plant: Plant) -> KernelTimeBound:
    """Counted in the graph that is compiled, timed in the same kind of kernel."""
    tape = divide_less(read(adaptive_attempt(plant)), {2, 3})
    once_a_run, used = fixed(tape, {2, 3}), tape.used()
    counts = Counter(node.op for i, node in enumerate(tape.nodes) if used[i] and not once_a_run[i])
    division = _time(plant, lambda x, j: (1.0 + j) / (x + j))
    root = _time(plant, lambda x, j: ca.sqrt(x + j))
    return KernelTimeBound(counts["div"], counts["sqrt"], division, root)


def _time(plant: Plant, term: Callable[[ca.SX, float], ca.SX]) -> float:
    """Time [s] of one operation in one lane, from sums of 16 independent ones over every state of 4000 rows."""
    x, u, p = ca.SX.sym("x", plant.n), ca.SX.sym("u", len(plant.inputs)), ca.SX.sym("p", len(plant.parameters))
    sums = [sum((term(x[i], j + 0.5) for j in range(_TERMS)), ca.SX(0)) for i in range(plant.n)]
    kernel = CompiledPlant(
        adaptive_attempt(plant), ca.Function("rate", [x, u, p], [ca.vertcat(*sums)]), plant.p, Stepping(1.0, 1.0, 1)
    )
    rows = 1.0 + np.random.default_rng(0).random((_ROWS, plant.n))
    inputs = np.zeros(len(plant.inputs))
    times = []
    for _ in range(_REPEATS):
        began = perf_counter()
        kernel.outputs(rows, inputs)
        times.append(perf_counter() - began)
    return min(times) / (_ROWS * plant.n * _TERMS)
