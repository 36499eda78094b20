"""Controllers of which only the law is a graph: casadi is loaded when one is made, not when its class is."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .graph_law import GraphLaw


class ByGraph:
    """What a law as a graph decides."""

    def __init__(self, law: "GraphLaw") -> None:
        from .graph_law import GraphController

        self._controller = GraphController(law)

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump, the past at rest."""
        self._controller.reset(reference, measurement, command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The command now."""
        return self._controller.compute(reference, measurement)

    def update(self, realised: float) -> None:
        """The law's states, one period on."""
        self._controller.update(realised)

    def graph_law(self) -> "GraphLaw":
        """The law."""
        return self._controller.graph_law()
