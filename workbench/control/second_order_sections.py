"""Linear laws as factors, never as polynomials: sampled into second-order sections, run section by section, and the
abstract controller of such sections on an error.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from ..engine import lazy_casadi as ca
from ..linear.interconnect import series
from ..linear.state_space import StateSpace, state_space
from .law import Law, LawController


@dataclass(frozen=True)
class Factors:
    """gain * product of (1 - s/zero) / product of (1 - s/pole), zeros [m] and poles [n] in rad/s, m <= n.

    Both come real or in conjugate pairs and none is 0, so that `gain` is the gain at s = 0.
    """

    zeros: np.ndarray
    poles: np.ndarray
    gain: float = 1.0

    def __mul__(self, other: "Factors") -> "Factors":
        return Factors(np.append(self.zeros, other.zeros), np.append(self.poles, other.poles), self.gain * other.gain)

    def __call__(self, f: np.ndarray) -> np.ndarray:
        """The response at f [k] in Hz, complex [k]."""
        s = 2j * np.pi * np.asarray(f)[:, None]
        return self.gain * np.prod(1 - s / self.zeros, axis=1) / np.prod(1 - s / self.poles, axis=1)


def pair(frequency: float, damping: float) -> np.ndarray:
    """The two roots [rad/s] of s^2 + 2 damping w s + w^2, for a natural frequency [Hz] and a damping [1]."""
    turn = np.emath.sqrt(damping**2 - 1)
    return 2 * np.pi * frequency * np.array([-damping + turn, -damping - turn])


def tustin(law: Factors, period: float, exact: float) -> np.ndarray:
    """Sections [k, 6], as scipy.signal has them, of a law sampled every `period` [s]; `exact` [Hz] is not warped.

    Tustin's rule prewarped, s = w/tan(w T/2) (z - 1)/(z + 1) at w = 2 pi exact, root by root (Åström and Wittenmark,
    Computer-Controlled Systems, 3rd ed. 1997, sec. 8.3). `linear.state_space.tustin` goes by matrices, which lose the
    digits of many roots close together, and does not prewarp.
    """
    from scipy.signal import zpk2sos  # here, as it takes a second

    scale = 2 * np.pi * exact / np.tan(np.pi * exact * period)
    zeros, poles = ((scale + roots) / (scale - roots) for roots in (law.zeros, law.poles))
    zeros = np.append(zeros, -np.ones(len(poles) - len(zeros)))
    return zpk2sos(zeros, poles, law.gain * np.real(np.prod(1 - poles) / np.prod(1 - zeros)))


def integral(frequency: float, period: float) -> np.ndarray:
    """One section [1, 6] of 1 + w/s with its corner at `frequency` [Hz], by Tustin's rule; none [0, 6] for 0 Hz."""
    half = np.pi * frequency * period
    return np.array([[1 + half, half - 1, 0.0, 1.0, -1.0, 0.0]])[: int(frequency > 0)]


def sections_response(sections: np.ndarray, f: np.ndarray, period: float) -> np.ndarray:
    """Response of sections [k, 6] at f [n] in Hz, complex [n]."""
    z = np.exp(2j * np.pi * np.asarray(f) * period)[:, None]
    b0, b1, b2, a0, a1, a2 = sections.T
    return np.prod((b0 + (b1 + b2 / z) / z) / (a0 + (a1 + a2 / z) / z), axis=1)


def sections_system(sections: np.ndarray, period: float) -> StateSpace:
    """Sections [k, 6] one after the other, as a discrete state space with two states a section."""
    whole = state_space([], [], [], [[1.0]], period, ["in"], ["in"])
    for b0, b1, b2, _, a1, a2 in sections:
        enter = [[b1 - a1 * b0], [b2 - a2 * b0]]
        section = state_space([[-a1, 1], [-a2, 0]], enter, [[1, 0]], [[b0]], period, ["in"], ["in"])
        whole = series(whole, section)
    order = np.arange(2 * len(sections)).reshape(-1, 2)[::-1].ravel()  # `series` has the last section's states first
    return replace(whole, A=whole.A[order][:, order], B=whole.B[order], C=whole.C[:, order], output_labels=["out"])


class SectionController(LawController):
    """command = memory(ahead(reference - controlled signal)). A controller gives both, in __init__, as sections.

    `ahead` holds what is fast, `memory` what would wind up. Anti-windup: the memory takes in what would have led to
    the command that the drive really got (the conditioning technique of Hanus, Kinnaert, Henrotte, Automatica 23(6),
    1987), so its sections answer at once and have their zeros inside the unit circle. To put what is fast through the
    same would let a limit ring at its zeros.
    """

    measures: ClassVar[tuple[str, ...]] = ("position",)

    def __init__(self, ahead: np.ndarray, memory: np.ndarray, period: float) -> None:
        super().__init__(section_law(ahead, memory, period))


def section_law(ahead: np.ndarray, memory: np.ndarray, period: float) -> Law:
    """The law of sections [k, 6] and [m, 6], as scipy.signal has them; direct form II, transposed."""
    direct = float(np.prod(memory[:, 0]))
    numbers = {"ahead": ahead[:, [0, 1, 2, 4, 5]], "memory": memory[:, [0, 1, 2, 4, 5]], "direct": direct}
    states = {"fast": 2 * len(ahead), "slow": 2 * len(memory)}

    def through(sections: "ca.SX", x: "ca.SX", value: "ca.SX") -> tuple["ca.SX", list["ca.SX"]]:
        """What sections make of a value, and their states after."""
        after = []
        for k in range(x.numel() // 2):
            b0, b1, b2, a1, a2 = (sections[5 * k + i] for i in range(5))
            out = b0 * value + x[2 * k]
            after += [b1 * value - a1 * out + x[2 * k + 1], b2 * value - a2 * out]
            value = out
        return value, after

    def command(x: SimpleNamespace, s: SimpleNamespace, o: "ca.SX", q: SimpleNamespace) -> "ca.SX":
        shaped, _ = through(q.ahead, x.fast, s.reference - s.position)
        return through(q.memory, x.slow, shaped)[0] + o

    def advance(x: SimpleNamespace, s: SimpleNamespace, v: "ca.SX", o: "ca.SX", q: SimpleNamespace) -> list["ca.SX"]:
        """The memory goes to where the command that the drive really got leaves it."""
        shaped, fast = through(q.ahead, x.fast, s.reference - s.position)
        demanded, _ = through(q.memory, x.slow, shaped)
        _, slow = through(q.memory, x.slow, shaped + (v - o - demanded) / q.direct)
        return [*fast, *slow]

    def start(s: SimpleNamespace, u: "ca.SX") -> tuple[list["ca.SX"], "ca.SX"]:
        """The sections rest at this error, an offset keeps the command that the drive holds; an integrator holds
        nothing."""
        x, value = [], s.reference - s.position
        for b0, b1, b2, _, a1, a2 in np.vstack((ahead, memory)).tolist():
            resting = 1 + a1 + a2
            out = (b0 + b1 + b2) / resting * value if resting else b0 * value
            second = b2 * value - a2 * out if resting else 0 * value
            x += [b1 * value - a1 * out + second if resting else 0 * value, second]
            value = out
        return x, u - value

    key = "sections", len(ahead), len(memory)
    return Law.of(
        command, advance, start, states=states, numbers=numbers, measures=("position",), period=period, key=key
    )
