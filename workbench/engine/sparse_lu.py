"""Sparse LU factors of a symbolic matrix, with a fixed elimination order chosen once from its structure."""

import casadi as ca


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
