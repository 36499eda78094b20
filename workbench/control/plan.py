"""What a controller's reference goes through where that is no filter: a plan, as a graph."""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..linear.state_space import StateSpace

if TYPE_CHECKING:
    import casadi as ca


class Plan(ABC):
    """Graphs from signals to a controller's reference and to what is added to its command; `inputs`: the signals, the
    reference first."""

    @property
    @abstractmethod
    def inputs(self) -> tuple[str, ...]:
        """Names of the signals."""

    @property
    @abstractmethod
    def states(self) -> int:
        """How many."""

    @cached_property
    @abstractmethod
    def numbers(self) -> np.ndarray:
        """What the graphs take as parameters q [k]."""

    @cached_property
    @abstractmethod
    def linear(self) -> StateSpace:
        """About rest: from its inputs to "reference" and "command"."""

    @abstractmethod
    def rest(self, reference: float) -> np.ndarray:
        """The state at rest [n]."""

    @abstractmethod
    def output(self, w: "ca.SX", signals: "ca.SX", q: "ca.SX") -> tuple["ca.SX", "ca.SX"]:
        """The controller's reference, and what is added to its command."""

    @abstractmethod
    def advance(self, w: "ca.SX", signals: "ca.SX", q: "ca.SX") -> "ca.SX":
        """The state after a sample."""

    @cached_property
    def functions(self) -> tuple["ca.Function", "ca.Function"]:
        """`output` and `advance` of numbers: (w, signals) -> (reference, command) and w."""
        import casadi as ca

        w, s = ca.SX.sym("w", self.states), ca.SX.sym("s", len(self.inputs))
        q = ca.SX(ca.DM(self.numbers))
        return ca.Function("output", [w, s], [*self.output(w, s, q)]), ca.Function(
            "after", [w, s], [self.advance(w, s, q)]
        )
