"""What a controller's reference goes through where that is no filter: a plan, as a graph."""

from abc import ABC, abstractmethod
from collections.abc import Hashable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

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

    @abstractmethod
    def rest(self, reference: "ca.SX") -> "ca.SX":
        """The state at rest [n]."""

    @abstractmethod
    def output(self, w: "ca.SX", signals: "ca.SX", q: "ca.SX") -> tuple["ca.SX", "ca.SX"]:
        """The controller's reference, and what is added to its command."""

    @abstractmethod
    def advance(self, w: "ca.SX", signals: "ca.SX", q: "ca.SX") -> "ca.SX":
        """The state after a sample."""

    @property
    def key(self) -> Hashable:
        """All that the graphs depend on, but for the numbers."""
        return type(self), self.inputs, self.states, len(self.numbers)
