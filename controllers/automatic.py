"""P with pressure feedback that tunes itself: moves of a millimetre, and gains by rules from what they tell."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from workbench.control.automatic_tuning import pulses, small_moves, tuned
from workbench.control.controller_spec import ControllerSpec
from workbench.control.controller_type import controller
from workbench.control.protocol import design_numbers, linear_view, number
from workbench.linear.interconnect import select
from workbench.linear.state_space import StateSpace


class Automatic:
    """Holds the jack by a slow P, whatever the reference, pulses the command, and hands over to what it has tuned.

    `law` is that controller, by itself, which knows no more of the moves; None until they are over. At the change it
    takes the signals that it finds for those that are asked for. The rules are those of
    workbench.control.automatic_tuning; they are computed in the `update` after the last move, in tens of milliseconds.
    """

    measures: ClassVar[tuple[str, ...]] = ("position", "pa", "pb")

    @design_numbers
    class Design:
        """Design numbers."""

        hold: float = number("1/m", 1e-3, 1e3, "gain of the slow loop during the moves")
        pulse: float = number("1", 1e-4, 0.5, "command that moves the jack a millimetre in 0.1 s")
        column: float = number("m", 0.0, 100.0, "half the oil columns' length; 0: the same gain all over", 0.0)
        middle: float = number("m", -100.0, 100.0, "position signal at mid stroke", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        self._design, self._period = design, period
        self._pulses = pulses(design.pulse, period)
        self._slow = self._active = controller("controllers.p:P", gain=design.hold).build(period)
        self.law: ControllerSpec | None = None
        self._moved = len(self._pulses)  # nothing to play before a start

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump, and with the moves."""
        self._start, self._standing = measurement["position"], command
        self._moved, self._rows = 0, list[tuple[float, float, float]]()
        self.law, self._active = None, self._slow
        self._slow.reset(self._start, measurement, command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The slow loop's command and a pulse on top; later the tuned law's."""
        self._measured = measurement
        asked = self._start if self._moved < len(self._pulses) else reference
        return self._active.compute(asked, measurement) + self._pulse

    def update(self, realised: float) -> None:
        """Advance the law in charge, note what moved; after the last move, tune."""
        self._active.update(realised - self._pulse)
        if self._moved == len(self._pulses):
            return
        seen = self._measured
        self._rows.append((realised - self._standing, seen["position"], seen["pa"] - seen["pb"]))
        self._moved += 1
        if self._moved == len(self._pulses):
            self._tune()

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """The law in charge: before the moves are over, the slow loop."""
        return select(linear_view(self._active, at), ["reference", *self.measures], ["command"])

    @property
    def _pulse(self) -> float:
        return float(self._pulses[self._moved]) if self._moved < len(self._pulses) else 0.0

    def _tune(self) -> None:
        command, position, load = np.array(self._rows).T
        moves = small_moves(command, position, load, self._period)
        self.law = tuned(moves, self._design.column, self._design.middle)
        self._active = self.law.build(self._period)
        self._active.reset(self._measured["position"], self._measured, self._standing)
