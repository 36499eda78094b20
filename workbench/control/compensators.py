"""Compensators: filters, static maps, plans, sines and networks that stack on any controller."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol, cast

from ..linear.state_space import StateSpace, as_state_space, of_sum, transfer_function, tustin
from .law import LawController
from .piecewise_linear import CommandMap
from .protocol import Controller, graph_law
from .shell import Around, Shell, around
from .shells import FilterShell, MapShell

if TYPE_CHECKING:
    import control

Into = Literal["command", "reference", "map", "graph", "dither"]


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


class Surrounds(Protocol):
    """Graphs of its own around a law: `into` is "graph" or "dither"."""

    into: ClassVar[Into]

    @property
    def shell(self) -> Shell:
        """The graphs, at the loop's period."""
        ...


AnyCompensator = Compensator | MapsCommand | Surrounds


def shell_of(compensator: AnyCompensator) -> Shell:
    """The graphs of a compensator."""
    own = cast(Any, compensator)
    if compensator.into == "map":
        return MapShell(own.command_map)
    if compensator.into in ("graph", "dither"):
        return own.shell
    return FilterShell(as_state_space(own.law), compensator.into == "reference", getattr(own, "schedule", None))


def compensated(inner: Controller, compensator: AnyCompensator) -> Controller:
    """A controller with a compensator around it, itself a controller. The inner one sees the reference as filtered.

    What the drive did not do is the inner controller's affair: it learns the realised command less what was added.
    """
    return surrounded(inner, shell_of(compensator))


def surrounded(inner: Controller, shell: Shell) -> Controller:
    """A controller with a shell around it: one law, or, about a controller in plain Python, the shell played there."""
    law = graph_law(inner)
    return Around(inner, shell) if law is None else LawAround(inner, around(law, shell))


class LawAround(LawController):
    """A law that stands around a controller's."""

    def __init__(self, inner: Controller, law: Any) -> None:
        super().__init__(law)
        self.inner = inner


def innermost(controller: Controller) -> Controller:
    """The controller within all that is around it."""
    return innermost(controller.inner) if isinstance(controller, Around | LawAround) else controller


def deflection(stiffness: float, period: float) -> Shell:
    """The controller's reference is a force over a stiffness [N/m]."""
    return FilterShell(weighted([1], [1], period, {"reference": 1 / stiffness}), True)


def weighted(
    numerator: Sequence[float], denominator: Sequence[float], period: float, inputs: Mapping[str, float]
) -> StateSpace:
    """numerator(s)/denominator(s), highest power first, by Tustin's rule at `period` [s], of a weighted sum of inputs.

    `inputs` gives each signal's weight; the output is called "out". Raises ValueError for more zeros than poles.
    """
    sampled = tustin(transfer_function(numerator, denominator), period)
    return of_sum(StateSpace(*sampled, period, ["in"], ["out"]), inputs)
