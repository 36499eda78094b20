"""Compensators around a controller in lanes: as in `compensators`, every signal an array [lanes]."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from .discrete_filter import Filter
from .piecewise_linear import CommandMap, PiecewiseLinear
from .protocol import LaneController

if TYPE_CHECKING:
    import casadi as ca

    from .plan import Plan

Signals = Mapping[str, np.ndarray]


class _LanesAround:
    """What is around a controller in lanes passes on what it is told."""

    def __init__(self, inner: LaneController) -> None:
        self._inner = inner

    def set_preview(self, future: np.ndarray) -> None:
        """The references [preview + 1, lanes] that the inner controller will see."""
        cast(Any, self._inner).set_preview(future)

    def stop(self, lanes: np.ndarray) -> None:
        """These lanes have tripped."""
        self._inner.stop(lanes)


class CompensatedLanes(_LanesAround):
    """A controller in lanes with a filter of `inputs` around it: of its reference where it `shapes`, else beside it."""

    def __init__(
        self,
        inner: LaneController,
        filtered: Filter,
        inputs: tuple[str, ...],
        shapes: bool,
        schedule: PiecewiseLinear | None,
    ) -> None:
        super().__init__(inner)
        self._filter, self._inputs, self._shapes, self._schedule = filtered, inputs, shapes, schedule
        self._factor = self._added = np.zeros(0)
        self._signals = np.zeros((len(inputs), 0))

    def reset(self, reference: np.ndarray, measurement: Signals, command: np.ndarray) -> None:
        """Start without a bump: the filters rest at these signals, and the inner controller makes up the commands."""
        self._factor, self._added = np.ones(len(reference)), np.zeros(len(reference))
        self._signals = np.zeros((len(self._inputs), len(reference)))
        self._look(reference, measurement)
        self._filter.rest(self._signals)
        inner = self._split(reference)
        self._inner.reset(inner, measurement, command - self._added)

    def compute(self, reference: np.ndarray, measurement: Signals) -> np.ndarray:
        """The inner controller's commands with the compensator's part."""
        self._look(reference, measurement)
        return self._inner.compute(self._split(reference), measurement) + self._added

    def update(self, realised: np.ndarray) -> None:
        """Advance both by one period."""
        self._filter.step(self._signals)
        self._inner.update(realised - self._added)

    def set_preview(self, future: np.ndarray) -> None:
        """The references [preview + 1, lanes] that the inner controller will see."""
        super().set_preview(self._filter.ahead(future) if self._shapes else future)

    def _look(self, reference: np.ndarray, measurement: Signals) -> None:
        """The filters' inputs and their factors; what is not finite leaves the last ones."""
        signals = np.array([reference if name == "reference" else measurement[name] for name in self._inputs])
        self._signals = np.where(np.isfinite(signals).all(axis=0), signals, self._signals)
        if self._schedule:
            position = measurement["position"]
            self._factor = np.where(np.isfinite(position), self._schedule.over(position), self._factor)

    def _split(self, reference: np.ndarray) -> np.ndarray:
        """The inner controller's references; keeps what is added to its commands."""
        output = self._factor * self._filter.outputs(self._signals)
        if self._shapes:
            return output
        self._added = output
        return reference


class MappedLanes(_LanesAround):
    """A controller in lanes whose commands go through a static map."""

    def __init__(self, inner: LaneController, command_map: CommandMap) -> None:
        super().__init__(inner)
        self._shift, self._back = command_map.shift, command_map.back

    def reset(self, reference: np.ndarray, measurement: Signals, command: np.ndarray) -> None:
        """Start the inner controller without a bump."""
        self._inner.reset(reference, measurement, command + self._back.over(command))

    def compute(self, reference: np.ndarray, measurement: Signals) -> np.ndarray:
        """The inner controller's commands, mapped."""
        command = self._inner.compute(reference, measurement)
        return command + self._shift.over(command)

    def update(self, realised: np.ndarray) -> None:
        """Advance the inner controller."""
        self._inner.update(realised + self._back.over(realised))


class OnLoadCellLanes(_LanesAround):
    """A controller of position in lanes on load cells: its position is force over stiffness [N/m]."""

    def __init__(self, inner: LaneController, stiffness: float) -> None:
        super().__init__(inner)
        self._stiffness = stiffness

    def reset(self, reference: np.ndarray, measurement: Signals, command: np.ndarray) -> None:
        """Start the inner controller without a bump."""
        self._inner.reset(reference, self._deflected(measurement), command)

    def compute(self, reference: np.ndarray, measurement: Signals) -> np.ndarray:
        """The inner controller's commands."""
        return self._inner.compute(reference, self._deflected(measurement))

    def update(self, realised: np.ndarray) -> None:
        """Advance the inner controller."""
        self._inner.update(realised)

    def _deflected(self, measurement: Signals) -> dict[str, np.ndarray]:
        return {**measurement, "position": measurement["force"] / self._stiffness}


class PlannedLanes(_LanesAround):
    """A controller in lanes within a plan of its references; it learns what was realised less what the plan added."""

    def __init__(self, inner: LaneController, plan: "Plan") -> None:
        super().__init__(inner)
        self._plan, self._added = plan, np.zeros(0)
        self._state, self._signals = np.zeros((plan.states, 0)), np.zeros((len(plan.inputs), 0))

    def reset(self, reference: np.ndarray, measurement: Signals, command: np.ndarray) -> None:
        """Start without a bump: the plans rest at the references."""
        self._state = np.array([self._plan.rest(each) for each in reference]).T
        self._signals, self._added = np.zeros((len(self._plan.inputs), len(reference))), np.zeros(len(reference))
        self._look(reference, measurement)
        self._inner.reset(reference, measurement, command)

    def compute(self, reference: np.ndarray, measurement: Signals) -> np.ndarray:
        """The inner controller's commands at the planned references, with those for their flow."""
        self._look(reference, measurement)
        planned, self._added = (_row(part) for part in self._plan.functions[0](self._state, self._signals))
        return self._inner.compute(planned, measurement) + self._added

    def update(self, realised: np.ndarray) -> None:
        """Advance both by one period."""
        self._inner.update(realised - self._added)
        self._state = np.array(self._plan.functions[1](self._state, self._signals))

    def set_preview(self, future: np.ndarray) -> None:
        """The references [preview + 1, lanes] that the inner controller will see."""
        output, advance = self._plan.functions
        state, planned = self._state, np.empty_like(future)
        for i, reference in enumerate(future):
            signals = np.vstack((reference, self._signals[1:]))
            planned[i] = _row(output(state, signals)[0])
            state = np.array(advance(state, signals))
        super().set_preview(planned)

    def _look(self, reference: np.ndarray, measurement: Signals) -> None:
        """What the plans see; what is not finite leaves the last signals."""
        signals = np.array([reference, *(measurement[name] for name in self._plan.inputs[1:])])
        self._signals = np.where(np.isfinite(signals).all(axis=0), signals, self._signals)


def _row(part: "ca.DM") -> np.ndarray:
    """Numbers [lanes] of a row."""
    return np.array(part).ravel()
