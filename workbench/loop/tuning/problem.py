"""What is searched, and what for: numbers of a controller in their ranges, on rigs of a set in scenarios."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from ...base.units import to_si
from ...control.controller_spec import ControllerSpec
from ...rigs.rig import Rig
from ..metrics import METRICS, SIGNAL
from ..rig_variations import Conditions
from ..scenarios import POSITIONS, Limits, Scenario

_DIGITS = 4  # of a searched number: the file that a study leaves has the very numbers that were tried
USUAL_WEIGHTS = {"settling_s": 10.0, "iae": 10.0, "overshoot_percent": 0.05, "ms": 0.2}
"""Of the metrics that a cost adds up, each over its unit (`weight_unit`), where nobody gives any."""
OF_THE_LOOP = {"stiffness": "N/m"}


@dataclass(frozen=True)
class Searched:
    """A number that is searched from `low` to `high`, first at `start`, all in `unit`; `path` leads to it."""

    path: tuple[str | int, ...]
    unit: str
    low: float
    high: float
    start: float
    log: bool

    @property
    def is_weight(self) -> bool:
        """Whether it is one of a network's numbers, which a file has and no table."""
        return isinstance(self.path[-1], int)

    @property
    def name(self) -> str:
        """The number's name in metrics.json: gain, or compensators.1.gain of the first compensator."""
        return ".".join(str(key + 1) if isinstance(key, int) else key for key in self.path)

    def rounded(self, value: float) -> float:
        """To four digits, and within the ends."""
        return min(max(float(f"{value:.{_DIGITS}g}"), self.low), self.high)


@dataclass(frozen=True)
class TuneProblem:
    """A search: `rigs` are those of the set by name, nominal first; `weights` those of metrics, as USUAL_WEIGHTS.

    `seed` is the sampler's, that of the sensors' noise is in `conditions`. The envelope: those rigs at `positions`,
    shares of the stroke limit, and plants drawn over `factors` and declared bounds; `limits` of the hard goals.
    """

    rig: Rig
    controller: ControllerSpec
    searched: tuple[Searched, ...]
    scenarios: tuple[Scenario, ...]
    rigs: Mapping[str, Rig]
    weights: Mapping[str, float]
    trials: int
    seed: int
    conditions: Conditions
    positions: tuple[float, ...] = POSITIONS
    factors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    limits: Limits = field(default_factory=Limits)

    def design(self, values: Mapping[str, float]) -> ControllerSpec:
        """The controller with these numbers by name, each in its unit. Raises InputError where they make none."""
        controller = self.controller
        for number in self.searched:
            controller = with_number(controller, number.path, values[number.name], number.unit)
        return controller


def weight_unit(key: str) -> str:
    """The unit of a metric's weight in a cost, which has none; an IAE counts over its step."""
    unit = METRICS[key].unit.removeprefix(SIGNAL).strip()
    return "1" if unit == "1" else f"1/{unit}"


def with_number(controller: ControllerSpec, path: tuple[str | int, ...], value: float, unit: str) -> ControllerSpec:
    """A controller with another value of the number that `path` leads to."""
    key = path[0]
    if key == "compensators":
        parts = list(controller.compensators)
        parts[int(path[1])] = with_number(parts[int(path[1])], path[2:], value, unit)
        return replace(controller, compensators=tuple(parts))
    if len(path) == 2:  # a number of what a design has in a file
        whole = getattr(controller.design, str(key)).with_number(path[1], value)
        return replace(controller, design=replace(controller.design, **{str(key): whole}))
    if key in OF_THE_LOOP:
        change: dict[str, Any] = {str(key): float(to_si(value, unit, OF_THE_LOOP[str(key)]))}
        return replace(controller, **change)
    si = next(entry.metadata["unit"] for entry in fields(controller.design) if entry.name == key)
    return replace(controller, design=replace(controller.design, **{str(key): float(to_si(value, unit, si))}))
