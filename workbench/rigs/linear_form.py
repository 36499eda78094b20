"""Ways to write a linear plant: matrices, a transfer function, or a chain of integrators, lags and modes.

A form knows the numbers that it has by name, and makes the matrices of them. The numbers may be floats or the symbols
of a graph: the arithmetic is the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import Any, Protocol

from ..base.units import Spec

Rows = list[list[Any]]
ANY = float("inf")
COEFFICIENT = Spec("1", -ANY, ANY, "as the model is written")


class LinearForm(Protocol):
    """x' = A x + B u + E d, y = C x, u and y in the units of the one who wrote it, d a force [N]; time in seconds."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the signals y."""
        ...

    @property
    def order(self) -> int:
        """Number of states."""
        ...

    def specs(self) -> dict[str, Spec]:
        """Unit, possible range and meaning of its numbers."""
        ...

    def matrices(self, number: Mapping[str, Any]) -> tuple[Rows, Rows, Rows, Rows]:
        """A [n, n], B [n, 1], C [outputs, n] and E [n, 1], 0 where no force acts on a state."""
        ...

    def tables(self, number: Mapping[str, float]) -> dict[str, Any]:
        """The table of a file that says the same, under its name."""
        ...


@dataclass(frozen=True)
class StateSpaceForm:
    """Matrices entry by entry: A_2_1 is in row 2 and column 1 of A, B_1 and E_1 belong to the first state."""

    order: int
    outputs: tuple[str, ...]
    loaded: bool

    def specs(self) -> dict[str, Spec]:
        """Every entry, also one that is 0: another plant of a set may have a number there."""
        states = range(1, self.order + 1)
        names = [f"A_{i}_{j}" for i in states for j in states] + [f"B_{i}" for i in states]
        names += [f"C_{i}_{j}" for i in range(1, len(self.outputs) + 1) for j in states]
        names += [f"E_{i}" for i in states if self.loaded]
        return dict.fromkeys(names, COEFFICIENT)

    def matrices(self, number: Mapping[str, Any]) -> tuple[Rows, Rows, Rows, Rows]:
        """The entries in their places."""
        states = range(1, self.order + 1)
        return (
            [[number[f"A_{i}_{j}"] for j in states] for i in states],
            [[number[f"B_{i}"]] for i in states],
            [[number[f"C_{i}_{j}"] for j in states] for i in range(1, len(self.outputs) + 1)],
            [[number[f"E_{i}"] if self.loaded else 0.0] for i in states],
        )

    def tables(self, number: Mapping[str, float]) -> dict[str, Any]:
        """[state_space]"""
        a, b, c, e = self.matrices(number)
        loaded = {"E": e} if self.loaded else {}
        return {"state_space": {"outputs": list(self.outputs), "A": a, "B": b, "C": c, **loaded}}


@dataclass(frozen=True)
class TransferFunctionForm:
    """num_0 s^m + ... + num_m over den_0 s^n + ... + den_n, m < n, in controllable form.

    `pace` [rad/s] is about where its poles are: the states are derivatives over its powers, and so of one size.
    """

    zeros: int
    order: int
    pace: float
    outputs: tuple[str, ...] = ("position",)

    def specs(self) -> dict[str, Spec]:
        """The coefficients, that of the highest power first."""
        names = [f"num_{i}" for i in range(self.zeros + 1)] + [f"den_{i}" for i in range(self.order + 1)]
        return dict.fromkeys(names, COEFFICIENT)

    def matrices(self, number: Mapping[str, Any]) -> tuple[Rows, Rows, Rows, Rows]:
        """s counted in `pace`."""
        n, pace = self.order, self.pace
        lead = number["den_0"]
        a = [[pace * float(j == i - 1) for j in range(n)] for i in range(n)]
        a[0] = [-number[f"den_{j + 1}"] / lead / pace**j for j in range(n)]
        c = [0.0 for _ in range(n)]
        for i in range(self.zeros + 1):
            power = self.zeros - i
            c[n - 1 - power] = number[f"num_{i}"] / lead / pace ** (n - 1 - power)
        b = [[float(i == 0)] for i in range(n)]
        return a, b, [c], [[0.0] for _ in range(n)]

    def tables(self, number: Mapping[str, float]) -> dict[str, Any]:
        """[transfer_function]"""
        numerator = [number[f"num_{i}"] for i in range(self.zeros + 1)]
        denominator = [number[f"den_{i}"] for i in range(self.order + 1)]
        return {"transfer_function": {"numerator": numerator, "denominator": denominator}}


@dataclass(frozen=True)
class ChainForm:
    """Lags 1/(1 + s lag_1), modes 1/(1 + 2 mode_1_damping s/w + s^2/w^2) and integrators 1/s, one after the other."""

    lags: int
    modes: int
    integrators: int
    outputs: tuple[str, ...] = ("position",)

    @property
    def order(self) -> int:
        """Number of states."""
        return self.lags + 2 * self.modes + self.integrators

    def specs(self) -> dict[str, Spec]:
        """Time constants, natural frequencies and damping ratios."""
        specs = {f"lag_{i + 1}": Spec("s", 1e-9, 1e9, "time constant") for i in range(self.lags)}
        for i in range(self.modes):
            specs[f"mode_{i + 1}_frequency"] = Spec("Hz", 1e-6, 1e6, "natural frequency")
            specs[f"mode_{i + 1}_damping"] = Spec("1", 0.0, 1e3, "damping ratio")
        return specs

    def matrices(self, number: Mapping[str, Any]) -> tuple[Rows, Rows, Rows, Rows]:
        """States in the order of the chain; of a mode its output, then the output's rate over w."""
        n = self.order
        a: Rows = [[0.0] * n for _ in range(n)]
        drives: list[tuple[int, Any]] = []  # the state that a part's input drives, and by how much
        ends: list[int] = []  # the state that is a part's output
        for i in range(self.lags):
            rate = 1 / number[f"lag_{i + 1}"]
            a[i][i] = -rate
            drives.append((i, rate))
            ends.append(i)
        for i in range(self.modes):
            at, w = self.lags + 2 * i, 2 * pi * number[f"mode_{i + 1}_frequency"]
            a[at][at + 1], a[at + 1][at] = w, -w
            a[at + 1][at + 1] = -2 * number[f"mode_{i + 1}_damping"] * w
            drives.append((at + 1, w))
            ends.append(at)
        for i in range(n - self.integrators, n):
            drives.append((i, 1.0))
            ends.append(i)
        for end, (driven, rate) in zip(ends, drives[1:], strict=False):
            a[driven][end] = rate
        entering, rate = drives[0]
        b = [[rate if i == entering else 0.0] for i in range(n)]
        return a, b, [[float(i == ends[-1]) for i in range(n)]], [[0.0] for _ in range(n)]

    def tables(self, number: Mapping[str, float]) -> dict[str, Any]:
        """[chain]"""
        modes = [
            {key: _entry(number[f"mode_{i + 1}_{key}"], unit) for key, unit in (("frequency", "Hz"), ("damping", "1"))}
            for i in range(self.modes)
        ]
        lags = [f"{number[f'lag_{i + 1}']!r} s" for i in range(self.lags)]
        parts = {"integrators": self.integrators, "lags": lags, "modes": modes}
        return {"chain": {name: part for name, part in parts.items() if part}}


def _entry(value: float, unit: str) -> dict[str, Any]:
    return {"value": value, "unit": unit}
