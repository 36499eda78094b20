"""Compensators: filters and static maps that stack on any controller, and controllers of position on a load cell."""

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol, cast

import numpy as np

from ..base.errors import InputError
from ..linear.interconnect import parallel, select, series
from ..linear.state_space import StateSpace
from .around import Around
from .discrete_filter import Filter, weighted
from .dither import Dithered, Sine
from .lane_compensators import CompensatedLanes, MappedLanes, OnLoadCellLanes
from .linear_law import LinearLaw, on_load_cell, with_command_filter, with_reference_filter
from .piecewise_linear import CommandMap, PiecewiseLinear
from .planned import Planned
from .protocol import (
    Controller,
    LaneController,
    lane_controller,
    linear_law,
    linear_view,
    operating,
    sampled_law,
    scheduled_law,
)
from .scheduled_law import ScheduledLaw

if TYPE_CHECKING:
    import control

    from .graph_law import GraphLaw
    from .plan import Plan


Into = Literal["command", "reference", "map", "plan", "graph", "dither"]


class Compensator(Protocol):
    """A stable linear filter beside a controller.

    `into` says what becomes of its output: it is added to the "command" [1], or is the controller's "reference".
    `law` is its discrete state space from signals, which are its input labels: "reference" or measured ones (SI).
    It may have a `schedule`: a factor of its output over the measured position [m].
    """

    into: ClassVar[Into]

    @property
    def law(self) -> "StateSpace | control.StateSpace":
        """The filter, at the loop's period."""
        ...


class MapsCommand(Protocol):
    """A static map that the command of a controller, with all that is added to it, goes through: `into` is "map"."""

    into: ClassVar[Into]

    @property
    def command_map(self) -> CommandMap:
        """The map."""
        ...


class PlansReference(Protocol):
    """A plan of a controller's reference, with a command of its own: `into` is "plan"."""

    into: ClassVar[Into]

    @property
    def plan(self) -> "Plan":
        """The plan, at the loop's period."""
        ...


class OnGraph(Protocol):
    """What is made of a law as a graph, a graph again: `into` is "graph"."""

    into: ClassVar[Into]

    def around(self, inner: "GraphLaw") -> "GraphLaw":
        """The law with it."""
        ...


class Dithers(Protocol):
    """A sine on top of a controller's command: `into` is "dither"."""

    into: ClassVar[Into]

    @property
    def sine(self) -> Sine:
        """The sine, at the loop's period."""
        ...


AnyCompensator = Compensator | MapsCommand | PlansReference | OnGraph | Dithers


def compensated(inner: Controller, compensator: AnyCompensator) -> Controller:
    """A controller with a compensator around it, itself a controller. Raises InputError where a graph is needed of a
    controller that has none."""
    if compensator.into == "graph":
        return _on_graph(inner, cast(OnGraph, compensator))
    if compensator.into == "plan":
        return Planned(inner, cast(PlansReference, compensator).plan)
    if compensator.into == "dither":
        return Dithered(inner, cast(Dithers, compensator).sine)
    if compensator.into == "map":
        return Mapped(inner, cast(MapsCommand, compensator).command_map)
    return Compensated(inner, cast(Compensator, compensator))


def _on_graph(inner: Controller, compensator: OnGraph) -> Controller:
    law = sampled_law(inner)
    if law is None:
        raise InputError(
            f"{type(inner).__name__} is neither data nor a graph; put {type(compensator).__name__} on another"
        )
    from .graph_law import GraphController, as_graph

    return cast(Controller, GraphController(compensator.around(as_graph(law))))


class Compensated(Around):
    """A controller with a compensator around it, itself a controller. The inner one sees the reference as filtered.

    What the drive did not do is the inner controller's affair: it learns the realised command less what was added.
    """

    def __init__(self, inner: Controller, compensator: Compensator) -> None:
        super().__init__(inner)
        self._shapes = compensator.into == "reference"
        self._schedule: PiecewiseLinear | None = getattr(compensator, "schedule", None)
        self._filter, self._inputs = Filter(compensator.law), tuple(compensator.law.input_labels)
        inputs = (*self._inputs, "position") if self._schedule else self._inputs
        self.measures = tuple(name for name in dict.fromkeys((*inner.measures, *inputs)) if name != "reference")
        self._factor = 1.0
        self._signals: list[float] = [0.0] * len(self._inputs)

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the filter rests at these signals, and the inner controller makes up the command."""
        signals = self._look(reference, measurement)
        self._filter.rest(signals)
        inner, added = self._split(reference, self._factor * self._filter.out(signals))
        self._inner.reset(inner, measurement, command - added)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The inner controller's command with the compensator's part."""
        signals = self._look(reference, measurement)
        inner, added = self._split(reference, self._factor * self._filter.out(signals))
        return self._inner.compute(inner, measurement) + added

    def update(self, realised: float) -> None:
        """Advance both by one period."""
        added = self._split(0.0, self._factor * self._filter.out(self._signals))[1]
        self._filter.step(self._signals)
        self._inner.update(realised - added)

    def _shaped(self, future: np.ndarray) -> np.ndarray:
        return self._filter.ahead(future) if self._shapes else future

    def linear_law(self) -> LinearLaw | None:
        """Both together as data, where the inner controller has such a law."""
        inner = linear_law(self._inner)
        around = with_reference_filter if self._shapes else with_command_filter
        return None if inner is None or self._schedule else around(inner, self._filter.law)

    def graph_law(self) -> "GraphLaw | None":
        """Both together as a graph, where the inner controller has data or a graph."""
        return self._graph

    def lanes(self) -> LaneController | None:
        """Both together in lanes, where the inner controller has that form."""
        inner, filtered = lane_controller(self._inner), Filter(self._filter.law)
        return inner and CompensatedLanes(inner, filtered, self._inputs, self._shapes, self._schedule)

    def _graph_around(self, inner: "GraphLaw") -> "GraphLaw":
        from .graph_law import with_filter

        return with_filter(inner, self._filter.law, self._shapes, self._schedule)

    def scheduled_law(self) -> ScheduledLaw:
        """Both together in the form that is exported; raises InputError where they have none."""
        inner = scheduled_law(self._inner)
        around = inner.with_reference_filter if self._shapes else inner.with_command_filter
        return around(self._filter.law, self._schedule)

    def _look(self, reference: float, measurement: Mapping[str, float]) -> list[float]:
        """The filter's inputs, and its factor; what is not finite leaves the last ones."""
        signals = [reference if name == "reference" else measurement[name] for name in self._inputs]
        if isfinite(sum(signals)):
            self._signals = signals
        if self._schedule and isfinite(position := measurement["position"]):
            self._factor = self._schedule(position)
        return self._signals

    def _split(self, reference: float, output: float) -> tuple[float, float]:
        """The inner controller's reference, and what is added to its command."""
        return (output, 0.0) if self._shapes else (reference, output)

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """Both together, from ("reference", *measures) to "command"."""
        inner, names = linear_view(self._inner, at), ["reference", *self.measures]
        beside = self._filter.law.relabelled(self._inputs, ["reference" if self._shapes else "command"])
        if self._schedule:
            factor = self._schedule(operating(at)["position"])
            beside = replace(beside, C=factor * beside.C, D=factor * beside.D)
        return select(series(beside, inner) if self._shapes else parallel(inner, beside), names, ["command"])


class Mapped(Around):
    """A controller whose command goes through a static map; it learns the realised command mapped back."""

    def __init__(self, inner: Controller, command_map: CommandMap) -> None:
        super().__init__(inner)
        self._map, self._shift, self._back = command_map, command_map.shift, command_map.back
        self.measures = inner.measures

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start the inner controller without a bump."""
        self._inner.reset(reference, measurement, command + self._back(command))

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The inner controller's command, mapped."""
        command = self._inner.compute(reference, measurement)
        return command + self._shift(command)

    def update(self, realised: float) -> None:
        """Advance the inner controller."""
        self._inner.update(realised + self._back(realised))

    def graph_law(self) -> "GraphLaw | None":
        """The inner controller's data or graph with the map."""
        return self._graph

    def lanes(self) -> LaneController | None:
        """The inner controller's form in lanes with the map."""
        inner = lane_controller(self._inner)
        return inner and MappedLanes(inner, self._map)

    def _graph_around(self, inner: "GraphLaw") -> "GraphLaw":
        from .graph_law import with_command_map

        return with_command_map(inner, self._map)

    def scheduled_law(self) -> ScheduledLaw:
        """The inner controller's with the map behind; raises InputError where there is none."""
        return scheduled_law(self._inner).with_command_map(self._map)

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """The inner law times the slope of the map at the command of the operating point."""
        command = operating(at)["command"]
        slope = self._shift.slope(command + self._back(command)) + 1.0
        law = linear_view(self._inner, at)
        return replace(law, C=slope * law.C, D=slope * law.D)


class OnLoadCell(Around):
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

    def graph_law(self) -> "GraphLaw | None":
        """The inner controller's, where it has one."""
        return self._graph

    def lanes(self) -> LaneController | None:
        """The inner controller's form in lanes, where it has one."""
        inner = lane_controller(self._inner)
        return inner and OnLoadCellLanes(inner, self._stiffness)

    def scheduled_law(self) -> ScheduledLaw:
        """The inner controller's where it plans, else the linear view; raises InputError where there is none."""
        inner = scheduled_law(self._inner)
        if inner.core is None:
            return ScheduledLaw(self.linear())
        names = ["reference", *self.measures]
        core = inner.core.on("force", 1 / self._stiffness)
        return replace(inner, linear=inner.linear.relabelled(names, ["command"]), core=core)

    def _graph_around(self, inner: "GraphLaw") -> "GraphLaw":
        from .graph_law import of_scaled

        return of_scaled(inner, "force", 1 / self._stiffness)

    def _deflected(self, measurement: Mapping[str, float]) -> dict[str, float]:
        return {**measurement, "position": measurement["force"] / self._stiffness}

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """The inner law, of force over the stiffness."""
        law = linear_view(self._inner, at)
        scale = np.ones(law.B.shape[1])
        scale[1] /= self._stiffness
        return replace(law, B=law.B * scale, D=law.D * scale).relabelled(["reference", *self.measures], ["command"])


class Deflection:
    """The controller's reference is a force over a stiffness [N/m]."""

    into: ClassVar[Into] = "reference"

    def __init__(self, stiffness: float, period: float) -> None:
        self.law = weighted([1], [1], period, {"reference": 1 / stiffness})
