"""A controller of your own: P on a reference that never moves faster than the jack can."""

from collections.abc import Mapping
from typing import ClassVar

import control

from workbench.control.protocol import design_numbers, number


class SlewedP:
    """u = K (r' - y), where r' follows the reference at no more than a speed."""

    measures: ClassVar[tuple[str, ...]] = ("position",)  # what it needs, the controlled signal first

    @design_numbers
    class Design:
        """Design numbers: unit, bounds that tuning may search, meaning, and a default where there is one."""

        gain: float = number("1/m", 1e-3, 100.0, "command per position error K")
        speed: float = number("m/s", 0.01, 5.0, "largest speed of the reference", 2.0)

    def __init__(self, design: Design, period: float) -> None:
        self._gain, self._step = design.gain, design.speed * period
        self._period = period
        self._at = self._next = self._offset = 0.0

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the next `compute` with these signals returns `command`."""
        self._at = self._next = reference
        self._offset = command - self._gain * (reference - measurement["position"])

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The command [1], of signals in SI; changes no state that a second call would see."""
        self._next = self._at + min(self._step, max(-self._step, reference - self._at))
        return self._gain * (self._next - measurement["position"]) + self._offset

    def update(self, realised: float) -> None:
        """The drive got the command `realised`: go on by one period."""
        self._at = self._next

    def linear(self) -> control.StateSpace:
        """The law without its limit, from ("reference", *measures) to "command": margins come from here."""
        gains, names = [[self._gain, -self._gain]], ["reference", *self.measures]
        return control.StateSpace([], [], [], gains, self._period, inputs=names, outputs=["command"])
