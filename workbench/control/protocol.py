"""What a controller is: the protocol that every file in controllers/ follows."""

from collections.abc import Mapping
from dataclasses import field
from typing import Any, Protocol

import control


class Controller(Protocol):
    """A sampled controller. All signals SI; the command is -1..1.

    `measures` names the signals it needs, the controlled one first. A loop calls `reset` once, then in every period
    `compute` with what was just measured and `update` with the command that the guard let through.
    """

    @property
    def measures(self) -> tuple[str, ...]:
        """Names of measured signals."""
        ...

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the next `compute` with these signals returns `command` [1]."""
        ...

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The demanded command [1]; changes nothing."""
        ...

    def update(self, realised: float) -> None:
        """Advance the states by one period, knowing the command [1] that the drive really got."""
        ...

    def linear(self) -> control.StateSpace:
        """Discrete state space from ("reference", *measures) to "command", without limits."""
        ...


def preview(controller: Controller) -> int:
    """How many samples ahead a controller wants to know the reference: its attribute `preview`, where it has one.

    A loop then calls its `set_preview(future)` before each `compute`: the reference now and so far ahead [preview + 1].
    """
    return int(getattr(controller, "preview", 0))


def fallbacks(controller: Controller) -> int | None:
    """In how many periods since `reset` a controller's solver did not arrive: its attribute `fallbacks`."""
    return getattr(controller, "fallbacks", None)


def number(unit: str, low: float, high: float, meaning: str, default: float | None = None) -> Any:
    """A design number of a controller: SI unit, bounds [SI] that tuning may search, and its meaning."""
    metadata = {"unit": unit, "low": low, "high": high, "meaning": meaning}
    return field(metadata=metadata) if default is None else field(default=default, metadata=metadata)
