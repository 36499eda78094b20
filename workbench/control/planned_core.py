"""A predictive law in the form that is exported: its kernel, how it starts, and the filter that leads its reference."""

from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError
from ..engine.kernel import Kernel
from ..linear.interconnect import series
from ..linear.state_space import StateSpace
from .planned_law import PlannedLaw


@dataclass(frozen=True, eq=False)
class PlannedCore:
    """A law where the drive does what is demanded. starting [n, m + 2] makes the filter's state of what is measured,
    the reference within the stroke and the command; entering [n] is what a command adds to it."""

    kernel: Kernel
    starting: np.ndarray
    entering: np.ndarray
    stroke: float
    measures: tuple[str, ...]
    leading: StateSpace | None = None

    @property
    def reach(self) -> float:
        """The largest reference, in the unit of the controlled signal."""
        m = len(self.measures)
        return self.stroke / float(np.abs(self.kernel.table("PICK").reshape(-1, m)[:, 0]).max())

    @classmethod
    def of(cls, planned: PlannedLaw, kernel: Kernel) -> "PlannedCore":
        """That of a law without a preview. Raises InputError for one with a preview."""
        if planned.feedforward.shape[1] > 1:
            raise InputError("a law that knows its reference ahead cannot be exported; take the preview out")
        o, m = planned.observer, len(planned.observer.measures)
        *signals, reference, command = np.eye(m + 2)
        starting = o.beginning(dict(zip(o.measures, signals, strict=True)), reference, command, planned.law)
        return cls(kernel, starting, o.entering, planned.governor.stroke, o.measures)

    def on(self, signal: str, factor: float) -> "PlannedCore":
        """With another signal, times a factor, as the controlled one."""
        m = len(self.measures)
        scale = np.append(factor, np.ones(m - 1))
        kernel = Kernel(self.kernel.shape, self.kernel.numbers.copy())
        kernel.table("PICK")[:] = (kernel.table("PICK").reshape(-1, m) * scale).ravel()
        starting = self.starting * np.append(scale, [1.0, 1.0])
        return replace(self, kernel=kernel, starting=starting, measures=(signal, *self.measures[1:]))

    def led(self, leading: StateSpace) -> "PlannedCore":
        """With a filter of the reference in front. Raises InputError for one that takes another signal."""
        if leading.input_labels != ["reference"]:
            raise InputError("a filter of the reference that takes a measured signal cannot be exported; take it out")
        return replace(self, leading=leading if self.leading is None else series(leading, self.leading))

    def commands(self, references: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """The commands [k] along references [k], led already, and what is measured [k, m], from rest at 0."""
        state, asked, sent = np.zeros(len(self.entering)), 0.0, 0.0
        commands = np.empty(len(references))
        for i, (reference, signals) in enumerate(zip(references, measured, strict=True)):
            found = self.kernel(np.concatenate((state, [asked, sent], signals, [reference])))
            commands[i] = sent = float(found[0])
            asked, state = float(found[2]), found[3:] + self.entering * sent
        return commands
