"""One Rosenbrock step, and one attempt of an adaptive step, as symbolic graphs.

ROS3 (Sandu et al., Atmospheric Environment 31(20), 1997, "Benchmarking stiff ODE solvers for atmospheric chemistry
problems II", table 1): order 3 with an embedded order 2, three stages, L-stable, two evaluations of the rates.
"""

from dataclasses import dataclass

import casadi as ca

from ..plant import Plant

ORDER = 3
_GAMMA = 0.43586652150845899941601945119356
_C21 = -1.0156171083877702091975600115545
_C31 = 4.0759956452537699824805835358067
_C32 = 9.2076794298330791242156818474003
_M = (1.0, 6.1697947043828245592553615689730, -0.4277225654321857332623837380651)
_E = (0.5, -2.9079558716805469821718236208017, 0.2235406989781156962736090927619)

_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 5.0
SMALLEST = 1e-12  # s: a step below this has failed


def markowitz_order(pattern: list[set[int]]) -> list[int]:
    """Elimination order on the diagonal with least fill-in at each step. `pattern[i]`: columns of row i's nonzeros."""
    rows = [set(columns) | {i} for i, columns in enumerate(pattern)]
    left = set(range(len(rows)))
    order = []
    while left:

        def cost(k: int) -> tuple[int, int]:
            in_row = len(rows[k] & left) - 1
            in_column = sum(k in rows[i] for i in left) - 1
            return in_row * in_column, k

        pivot = min(left, key=cost)
        left.remove(pivot)
        order.append(pivot)
        for i in left:
            if pivot in rows[i]:
                rows[i] |= rows[pivot] & left
    return order


class SparseLU:
    """Factors a square SX matrix without pivoting: (1/(g h) I - J) is dominated by its diagonal for small h."""

    def __init__(self, matrix: ca.SX) -> None:
        n = matrix.shape[0]
        entries = {(i, j): matrix[i, j] for i, j in zip(*matrix.sparsity().get_triplet(), strict=True)}
        self._order = markowitz_order([{j for i, j in entries if i == row} for row in range(n)])
        self._lower: list[tuple[int, int, ca.SX]] = []
        self._upper: dict[int, list[tuple[int, ca.SX]]] = {}
        self._inverse: dict[int, ca.SX] = {}
        for step, k in enumerate(self._order):
            later = self._order[step + 1 :]
            self._inverse[k] = 1 / entries[k, k]
            row = [(j, entries[k, j]) for j in later if (k, j) in entries]
            self._upper[k] = row
            for i in later:
                if (i, k) in entries:
                    factor = entries[i, k] * self._inverse[k]
                    self._lower.append((i, k, factor))
                    for j, value in row:
                        entries[i, j] = entries.get((i, j), ca.SX(0)) - factor * value

    def solve(self, right: ca.SX) -> ca.SX:
        """x with matrix x = right, as a column."""
        x = [right[i] for i in range(right.numel())]
        for i, k, factor in self._lower:
            x[i] = x[i] - factor * x[k]
        for k in reversed(self._order):
            total = x[k]
            for j, value in self._upper[k]:
                total = total - value * x[j]
            x[k] = total * self._inverse[k]
        return ca.vertcat(*x)


@dataclass(frozen=True)
class RosenbrockStep:
    """New state and error estimate of one step of length h, as expressions."""

    state: ca.SX
    error: ca.SX


def step(plant: Plant, x: ca.SX, u: ca.SX, p: ca.SX, h: ca.SX) -> RosenbrockStep:
    """One ROS3 step from x [n] over h [s] with u held: (1/(g h) I - J) k_i = f(y_i) + sum_j c_ij k_j / h."""
    rates = plant.f(x, u, p)
    jacobian = ca.jacobian(rates, x)
    system = SparseLU(ca.SX.eye(plant.n) / (_GAMMA * h) - jacobian)
    k1 = system.solve(rates)
    second = plant.f(x + k1, u, p)
    k2 = system.solve(second + _C21 * k1 / h)
    k3 = system.solve(second + (_C31 * k1 + _C32 * k2) / h)
    stages = (k1, k2, k3)
    advance = sum((m * k for m, k in zip(_M, stages, strict=True)), ca.SX(0))
    error = sum((e * k for e, k in zip(_E, stages, strict=True)), ca.SX(0))
    return RosenbrockStep(x + advance, error)


def fixed_step(plant: Plant) -> ca.Function:
    """(x, u, p, h) -> x after one step of length h [s]."""
    x, u, p, h = _symbols(plant)
    return ca.Function("fixed", [x, u, p, h], [ca.cse(step(plant, x, u, p, h).state)])


@dataclass(frozen=True)
class Attempt:
    """One attempt of an adaptive step: whether it is fine, the state it leads to, and the clock after it.

    A clock is [time left, step, attempts].
    """

    fine: ca.SX
    state: ca.SX
    clock: ca.SX


def attempt(plant: Plant, x: ca.SX, u: ca.SX, p: ca.SX, clock: ca.SX, tolerance: ca.SX) -> Attempt:
    """Try one step. With no time left nothing changes.

    A step that is not finite is rejected like one whose error is too large; the caller sees a failure as a step below
    1e-12 s or as too many attempts.
    """
    left, h, attempts = ca.vertsplit(clock)
    trial = ca.fmin(h, left)
    active = left > 0
    length = ca.if_else(active, trial, 1e-6)
    result = step(plant, x, u, p, length)
    weight = tolerance * (ca.DM(plant.scale) + ca.fmax(ca.fabs(x), ca.fabs(result.state)))
    error = ca.sqrt(ca.sumsqr(result.error / weight) / plant.n)
    fine = ca.logic_and(error <= 1, active)
    growth = ca.fmin(_GROW, ca.fmax(_SHRINK, _SAFETY * (error + 1e-10) ** (-1.0 / ORDER)))
    factor = ca.if_else(error <= 1, growth, ca.if_else(error <= 1e6, ca.fmin(growth, 1), _SHRINK))
    # a step that was cut to reach the end says nothing about the next one being too long
    grown = ca.if_else(ca.logic_and(fine, trial < h), ca.fmax(h, trial * factor), trial * factor)
    remaining = ca.if_else(trial >= left, 0, left - trial)
    after = ca.vertcat(ca.if_else(fine, remaining, left), ca.if_else(active, grown, h), attempts + active)
    return Attempt(fine, result.state, after)


def adaptive_attempt(plant: Plant) -> ca.Function:
    """(s, u, p, tolerance) -> s, with s = [x, time left, step, attempts]: one accepted or rejected step."""
    x, u, p, _ = _symbols(plant)
    clock, tolerance = ca.SX.sym("clock", 3), ca.SX.sym("tolerance")
    tried = attempt(plant, x, u, p, clock, tolerance)
    after = ca.vertcat(ca.if_else(tried.fine, tried.state, x), tried.clock)
    return ca.Function("attempt", [ca.vertcat(x, clock), u, p, tolerance], [ca.cse(after)])


def failed(step_length: float) -> bool:
    """Whether an adaptive step has become uselessly short."""
    return not step_length > SMALLEST


def _symbols(plant: Plant) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    return (
        ca.SX.sym("x", plant.n),
        ca.SX.sym("u", len(plant.inputs)),
        ca.SX.sym("p", len(plant.parameters)),
        ca.SX.sym("h"),
    )
