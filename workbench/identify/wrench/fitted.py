"""Mass, centre and inertia of a platform's payload, from the forces and motions that its legs measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...records import Campaign, Record
from ...records.campaign import ROLES
from ...rigs.platform import AXES, Platform
from .balance import NUMBERS, WrenchBalance, balance, linear_numbers, payload_numbers
from .lines import LineNoise, inner, line_noise, lines
from .motion import LegSignals, leg_signals, passed

FITTED, JUDGED = "train", "heldout"
SHOWN = 20.0  # Hz: below which wrenches are shown in time
_NORMAL = 1.96
_ROUNDS = 3  # of weights where nothing was recorded at rest


@dataclass(frozen=True, eq=False)
class WrenchProblem:
    """A platform as it is described, and what its legs measured in the records of each role; without `judging` nothing
    is said to be missing."""

    platform: Platform
    signals: Mapping[str, tuple[LegSignals, ...]]
    judging: bool = True

    @property
    def period(self) -> float:
        """From row to row, s."""
        return self.signals[FITTED][0].period

    @property
    def judges(self) -> bool:
        """Whether it can say that something is missing: records at rest tell the noise, held-out ones judge."""
        return self.judging and bool(self.signals["static"]) and bool(self.signals[JUDGED])

    @cached_property
    def declared(self) -> Mapping[str, tuple[WrenchBalance, ...]]:
        """The balances of the platform as it is described, by role."""
        return {role: tuple(balance(self.platform, legs) for legs in own) for role, own in self.signals.items()}

    @cached_property
    def noise(self) -> LineNoise:
        """By what records at rest leave; without any by what the fitted ones do."""
        linear = linear_numbers(np.array([self.platform[name] for name in NUMBERS]))
        if self.signals["static"]:
            return self._noise("static", linear)
        noise = LineNoise(np.ones((3, len(AXES))), 0)
        for _ in range(_ROUNDS):
            columns, wrench = whitened(self.declared[FITTED], noise, self.period)
            noise = self._noise(FITTED, solved(columns, wrench)[0])
        return noise

    def _noise(self, role: str, linear: np.ndarray) -> LineNoise:
        left = [lines(each.left(linear), self.period) for each in self.declared[role]]
        f, values = max(left, key=lambda each: len(each[0]))
        return line_noise(f, values)


def wrench_problem(platform: Platform, whole: Sequence[Campaign], judging: bool = True) -> WrenchProblem:
    """The problem of the records of each leg [6], whole."""
    signals = {role: tuple(leg_signals(legs) for legs in together(whole, role)) for role in ROLES}
    return WrenchProblem(platform, signals, judging)


def together(whole: Sequence[Campaign], role: str) -> list[tuple[Record, ...]]:
    """The records of a role, each as its six legs."""
    return list(zip(*(getattr(campaign, role) for campaign in whole), strict=True))


def whitened(balances: Sequence[WrenchBalance], noise: LineNoise, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns [rows, 10] and wrenches [rows] of all lines of all records, over their noise."""
    parts = [tuple(over_noise(values, noise, period) for values in (each.columns, each.wrench)) for each in balances]
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])


def over_noise(values: np.ndarray, noise: LineNoise, period: float) -> np.ndarray:
    """The lines of wrenches [n, 6, ..] over their noise [rows, ..]."""
    scaled = noise.over(*lines(values, period))
    return scaled.reshape(-1, *scaled.shape[2:])


def solved(columns: np.ndarray, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The numbers [k] that close a balance best, and their covariance for noise of size 1; of columns that tell the
    same, the shortest numbers."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    scaled = columns / size
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True)
    return inverse @ (scaled.T @ wrench) / size, inverse / np.outer(size, size)


@dataclass(frozen=True, eq=False)
class PayloadFit:
    """`values` and 95 % half widths [10], SI, by NUMBERS; the RMS [6] of the wrench about the origin, N and N m, that
    the payload asked for and that is left below SHOWN."""

    values: np.ndarray
    halves: np.ndarray
    wrench: np.ndarray
    left: np.ndarray


def fit_payload(problem: WrenchProblem) -> PayloadFit:
    """By least squares over the lines of the fitted records; what is left beyond the noise widens the intervals."""
    columns, wrench = whitened(problem.declared[FITTED], problem.noise, problem.period)
    linear, covariance = solved(columns, wrench)
    chi2 = max(1.0, float(np.mean((wrench - columns @ linear) ** 2)))
    return payload_fit(problem, linear, chi2 * covariance)


def payload_fit(problem: WrenchProblem, linear: np.ndarray, covariance: np.ndarray) -> PayloadFit:
    """The payload of linear numbers [10] with their covariance [10, 10]."""
    steps = np.diag(1e-6 * np.maximum(np.abs(linear), 1.0))
    slopes = np.column_stack(
        [(payload_numbers(linear + step) - payload_numbers(linear - step)) / (2 * step.sum()) for step in steps]
    )
    halves = _NORMAL * np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes))
    asked, left = (
        np.concatenate(
            [inner(passed(of(each), problem.period, SHOWN), problem.period) for each in problem.declared[FITTED]]
        )
        for of in (lambda each: each.columns @ linear, lambda each: each.left(linear))
    )
    return PayloadFit(payload_numbers(linear), halves, *(np.sqrt(np.mean(part**2, axis=0)) for part in (asked, left)))
