"""Proportional control: command = gain (reference - controlled signal)."""

from collections.abc import Mapping
from typing import ClassVar

from workbench.control.linear_law import LinearLaw, static
from workbench.control.protocol import design_numbers, number
from workbench.linear.state_space import StateSpace, state_space


class P:
    """u = K e on the position. The yardstick: a jack integrates, so it needs no more to arrive."""

    measures: ClassVar[tuple[str, ...]] = ("position",)

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("1/m", 1e-3, 1e3, "command per position error")

    def __init__(self, design: Design, period: float) -> None:
        self._gain, self._period = design.gain, period
        self._offset = 0.0

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: an offset keeps the command that the drive holds."""
        self._offset = command - self._gain * (reference - measurement["position"])

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """u = K (r - y) + the command found at the start."""
        return self._gain * (reference - measurement["position"]) + self._offset

    def update(self, realised: float) -> None:
        """No states."""

    def linear_law(self) -> LinearLaw:
        """The law as data."""
        return static([self._gain, -self._gain], self.measures)

    def linear(self) -> StateSpace:
        """The gains on reference and position."""
        gains = [[self._gain, -self._gain]]
        return state_space([], [], [], gains, self._period, ["reference", "position"], ["command"])
