"""The abstract controller of an error: second-order sections on reference less signal, whatever designed them."""

from types import SimpleNamespace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from .law import Law, LawController

if TYPE_CHECKING:
    import casadi as ca


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
