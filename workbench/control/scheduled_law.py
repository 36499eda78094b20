"""Linear laws with scheduled filters beside them, a static map behind, a sine on top: the form that is exported.

command = map(linear law + sum over the filters of factor(position) x output + predictive law) + sine
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..base.errors import InputError
from ..linear.interconnect import parallel, series
from ..linear.state_space import StateSpace
from .piecewise_linear import CommandMap, PiecewiseLinear

if TYPE_CHECKING:
    from .dither import Sine
    from .planned_core import PlannedCore


@dataclass(frozen=True, eq=False)
class ScheduledFilter:
    """A filter whose output, times a factor over the measured position [m], is added to the command."""

    filter: StateSpace
    factor: PiecewiseLinear


@dataclass(frozen=True, eq=False)
class ScheduledLaw:
    """A law where the drive does what is demanded; all systems from signals by name (SI) to "command" [1].

    A law that learns the realised command (anti-windup, an observer) learns it less what was added, and mapped back:
    where the drive does what is demanded, that is its own demand. So its channels here are those of the law alone, and
    those of the filters stand beside them, each times its factor of the moment, with the map behind the sum. A `core`
    is a predictive law whose command is added to theirs, before the map.
    """

    linear: StateSpace
    filters: tuple[ScheduledFilter, ...] = ()
    command_map: CommandMap | None = None
    sine: "Sine | None" = None
    core: "PlannedCore | None" = None

    def with_command_filter(self, beside: StateSpace, schedule: PiecewiseLinear | None) -> "ScheduledLaw":
        """With the output of a filter added to the command. Raises InputError behind a map or a sine."""
        self._before_its_map()
        beside = beside.relabelled(beside.input_labels, ["command"])
        if schedule is None:
            return replace(self, linear=parallel(self.linear, beside))
        return replace(self, filters=(*self.filters, ScheduledFilter(beside, schedule)))

    def with_reference_filter(self, leading: StateSpace, schedule: PiecewiseLinear | None) -> "ScheduledLaw":
        """With the output of a filter as its reference. Raises InputError for a scheduled one."""
        if schedule is not None:
            raise InputError("a reference filter with a schedule cannot be exported; take it out")
        leading = leading.relabelled(leading.input_labels, ["reference"])
        filters = tuple(replace(part, filter=_led(leading, part.filter)) for part in self.filters)
        core = self.core and self.core.led(leading)
        return replace(self, linear=_led(leading, self.linear), filters=filters, core=core)

    def with_command_map(self, command_map: CommandMap) -> "ScheduledLaw":
        """With a map behind. Raises InputError behind another one, or a sine."""
        self._before_its_map()
        return replace(self, command_map=command_map)

    def with_sine(self, sine: "Sine") -> "ScheduledLaw":
        """With a sine on top. Raises InputError on top of another one."""
        self._before_its_sine()
        return replace(self, sine=sine)

    def _before_its_map(self) -> None:
        if self.command_map is not None:
            raise InputError("compensators behind a map of the command cannot be exported; name the map last")
        self._before_its_sine()

    def _before_its_sine(self) -> None:
        if self.sine is not None:
            raise InputError("compensators behind a dither cannot be exported; name the dither last")


def _led(leading: StateSpace, law: StateSpace) -> StateSpace:
    return series(leading, law) if "reference" in law.input_labels else law
