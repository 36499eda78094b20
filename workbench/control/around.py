"""What stands around a controller, itself a controller: the base of compensators and of scaled force loops."""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from .protocol import Controller, fallbacks, preview, sampled_law

if TYPE_CHECKING:
    from .graph_law import GraphLaw


class Around(ABC):
    """What stands around a controller: it passes on what that may have besides the protocol."""

    def __init__(self, inner: Controller) -> None:
        self._inner, self.preview = inner, preview(inner)

    @property
    def fallbacks(self) -> int | None:
        """Of the inner controller."""
        return fallbacks(self._inner)

    def set_preview(self, future: np.ndarray) -> None:
        """The references that the inner controller will see."""
        if self.preview:
            cast(Any, self._inner).set_preview(self._shaped(future))

    def _shaped(self, future: np.ndarray) -> np.ndarray:
        return future

    @cached_property
    def _graph(self) -> "GraphLaw | None":
        """The whole as a graph, where the inner controller has data or a graph; made once, for it takes its time."""
        inner = sampled_law(self._inner)
        if inner is None:
            return None
        from .graph_law import as_graph

        return self._graph_around(as_graph(inner))

    @abstractmethod
    def _graph_around(self, inner: "GraphLaw") -> "GraphLaw":
        """The inner controller's graph with what is around it."""


def innermost(controller: Controller) -> Controller:
    """The controller within all that is around it."""
    return innermost(controller._inner) if isinstance(controller, Around) else controller
