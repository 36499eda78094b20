"""Compensators: linear filters that stack on any controller, and controllers of position put on a load cell."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol, cast

import numpy as np

from ..linear.interconnect import parallel, select, series
from ..linear.state_space import StateSpace
from .discrete_filter import Filter, weighted
from .linear_law import LinearLaw, on_load_cell, with_command_filter, with_reference_filter
from .protocol import Controller, fallbacks, linear_law, linear_view, preview

if TYPE_CHECKING:
    import control


class Compensator(Protocol):
    """A stable linear filter beside a controller.

    `into` says what becomes of its output: it is added to the "command" [1], or is the controller's "reference".
    `law` is its discrete state space from signals, which are its input labels: "reference" or measured ones (SI).
    """

    into: ClassVar[Literal["command", "reference"]]

    @property
    def law(self) -> "StateSpace | control.StateSpace":
        """The filter, at the loop's period."""
        ...


class _Around:
    """What is around a controller passes on what it may have besides the protocol."""

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


class Compensated(_Around):
    """A controller with a compensator around it, itself a controller. The inner one sees the reference as filtered.

    What the drive did not do is the inner controller's affair: it learns the realised command less what was added.
    """

    def __init__(self, inner: Controller, compensator: Compensator) -> None:
        super().__init__(inner)
        self._shapes = compensator.into == "reference"
        self._filter, self._inputs = Filter(compensator.law), tuple(compensator.law.input_labels)
        more = (name for name in self._inputs if name != "reference" and name not in inner.measures)
        self.measures = (*inner.measures, *more)
        self._signals: list[float] = [0.0] * len(self._inputs)

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the filter rests at these signals, and the inner controller makes up the command."""
        signals = self._look(reference, measurement)
        self._filter.rest(signals)
        inner, added = self._split(reference, self._filter.out(signals))
        self._inner.reset(inner, measurement, command - added)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The inner controller's command with the compensator's part."""
        inner, added = self._split(reference, self._filter.out(self._look(reference, measurement)))
        return self._inner.compute(inner, measurement) + added

    def update(self, realised: float) -> None:
        """Advance both by one period."""
        added = self._split(0.0, self._filter.out(self._signals))[1]
        self._filter.step(self._signals)
        self._inner.update(realised - added)

    def _shaped(self, future: np.ndarray) -> np.ndarray:
        return self._filter.ahead(future) if self._shapes else future

    def linear_law(self) -> LinearLaw | None:
        """Both together as data, where the inner controller has such a law."""
        inner = linear_law(self._inner)
        around = with_reference_filter if self._shapes else with_command_filter
        return None if inner is None else around(inner, self._filter.law)

    def _look(self, reference: float, measurement: Mapping[str, float]) -> list[float]:
        self._signals = [reference if name == "reference" else measurement[name] for name in self._inputs]
        return self._signals

    def _split(self, reference: float, output: float) -> tuple[float, float]:
        """The inner controller's reference, and what is added to its command."""
        return (output, 0.0) if self._shapes else (reference, output)

    def linear(self) -> StateSpace:
        """Both together, from ("reference", *measures) to "command"."""
        inner, names = linear_view(self._inner), ["reference", *self.measures]
        beside = self._filter.law.relabelled(self._inputs, ["reference" if self._shapes else "command"])
        return select(series(beside, inner) if self._shapes else parallel(inner, beside), names, ["command"])


class OnLoadCell(_Around):
    """A controller of position on a load cell: its position is force over stiffness [N/m], a specimen's deflection.

    Its reference is a deflection [m], as of a specimen whose far end stands; `Deflection` makes it of a force.
    """

    def __init__(self, inner: Controller, stiffness: float) -> None:
        super().__init__(inner)
        self._stiffness = stiffness
        self.measures = ("force", *inner.measures[1:])

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start the inner controller without a bump."""
        self._inner.reset(reference, self._deflected(measurement), command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The inner controller's command."""
        return self._inner.compute(reference, self._deflected(measurement))

    def update(self, realised: float) -> None:
        """Advance the inner controller."""
        self._inner.update(realised)

    def linear_law(self) -> LinearLaw | None:
        """The inner controller's, where it has one."""
        inner = linear_law(self._inner)
        return None if inner is None else on_load_cell(inner, self._stiffness)

    def _deflected(self, measurement: Mapping[str, float]) -> dict[str, float]:
        return {**measurement, "position": measurement["force"] / self._stiffness}

    def linear(self) -> StateSpace:
        """The inner law, of force over the stiffness."""
        law = linear_view(self._inner)
        scale = np.ones(law.B.shape[1])
        scale[1] /= self._stiffness
        return replace(law, B=law.B * scale, D=law.D * scale).relabelled(["reference", *self.measures], ["command"])


class Deflection:
    """The controller's reference is a force over a stiffness [N/m]."""

    into: ClassVar[Literal["command", "reference"]] = "reference"

    def __init__(self, stiffness: float, period: float) -> None:
        self.law = weighted([1], [1], period, {"reference": 1 / stiffness})
