"""What a controller is: the protocol that every file in controllers/ follows, and its design numbers."""

from collections.abc import Callable, Mapping
from dataclasses import Field, dataclass, field, fields
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, cast, dataclass_transform

from ..base.errors import InputError
from ..base.units import quantity
from ..linear.state_space import StateSpace, as_state_space

if TYPE_CHECKING:
    import control

    from .law import Law

T = TypeVar("T")


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

    def linear(self) -> "StateSpace | control.StateSpace":
        """Discrete state space from ("reference", *measures) to "command", without limits.

        The workbench's own (`workbench.linear.state_space`) or python-control's, which takes two seconds to import. A
        law that differs between operating points has `linear(at)` instead: see `linear_view`.
        """
        ...


def linear_view(controller: Controller, at: Mapping[str, float] | None = None) -> StateSpace:
    """A controller's linear view, its signals named as the protocol has them.

    `at` has the plant's outputs, the command [1] and the specimen's "stiffness" of the operating point, SI, by name: a
    law that differs between operating points, or a controller whose method is `linear(at)`, needs it. Raises
    NoLinearView for a controller without one, NeedsOperatingPoint for one that needs `at`, and InputError for one that
    is no system of its signals.
    """
    if law := graph_law(controller):
        return law_view(law, at)
    if not hasattr(controller, "linear"):
        raise NoLinearView(f"{type(controller).__name__} has no linear view; give it a method `linear`")
    linear = cast(Any, controller.linear)
    view = as_state_space(_seen(controller, linear, () if not signature(linear).parameters else (at,)))
    names = ("reference", *controller.measures)
    if view.D.shape != (1, len(names)):
        raise InputError(
            f"{type(controller).__name__}.linear: has {view.D.shape[1]} inputs and {view.D.shape[0]} outputs; make it "
            f"a system from {', '.join(names)} to the command"
        )
    return view.relabelled(names, ("command",))


def law_view(law: "Law", at: Mapping[str, float] | None) -> StateSpace:
    """(reference, *measures) -> command of a law; raises NeedsOperatingPoint for one that differs between points."""
    linear = (law.view or law).matrices
    return linear.view(law.measures, law.period) if linear else law.linearised(operating(at))


def _seen(controller: Controller, linear: Any, arguments: tuple[Any, ...]) -> Any:
    """What a method `linear` returns; raises NoLinearView for one that is not written, InputError where it fails."""
    name = type(controller).__name__
    try:
        view = linear(*arguments)
    except InputError:
        raise
    except NotImplementedError:  # a class of the user's own says so in the way Python has for it
        raise NoLinearView(f"{name} has no linear view; give it a method `linear`") from None
    except Exception as error:
        raise InputError(
            f"{name}.linear: {type(error).__name__}: {error}; return a state space, or leave the method out"
        ) from error
    try:
        return as_state_space(view)
    except InputError as error:
        raise InputError(f"{name}.linear: {error}, or leave the method out") from None


class NoLinearView(InputError):
    """A linear view was asked for of a controller that has none."""


class NeedsOperatingPoint(InputError):
    """A linear view was asked for without an operating point, and differs between them."""


def operating(at: Mapping[str, float] | None) -> Mapping[str, float]:
    """The signals of an operating point; raises NeedsOperatingPoint where none is given."""
    if at is None:
        raise NeedsOperatingPoint("this law is linear about an operating point only; name one")
    return at


def preview(controller: Controller) -> int:
    """How many samples ahead a controller wants to know the reference: its attribute `preview`, where it has one.

    A loop then calls its `set_preview(future)` before each `compute`: the reference now and so far ahead [preview + 1].
    """
    return int(getattr(controller, "preview", 0))


def graph_law(controller: Controller) -> "Law | None":
    """The law of a controller that gives it by its method `graph_law`; None of one that only computes in Python.

    A class that overrides how its base class computes has the law of that class no more.
    """
    classes = type(controller).__mro__

    def depth(name: str) -> int:
        return next((i for i, owner in enumerate(classes) if name in vars(owner)), len(classes))

    known = depth("graph_law")
    if known == len(classes) or any(depth(name) < known for name in ("reset", "compute", "update")):
        return None
    return cast(Any, controller).graph_law()


def fallbacks(controller: Controller) -> int | None:
    """In how many periods since `reset` a controller's solver did not arrive: its attribute `fallbacks`."""
    return getattr(controller, "fallbacks", None)


def number(unit: str, low: float, high: float, meaning: str, default: float | None = None) -> Any:
    """A design number of a controller, as a field of a class of `design_numbers`.

    Parameters
    ----------
    unit
        Its SI unit.
    low
        Least value [unit] that it may have and that tuning may search.
    high
        Largest value [unit].
    meaning
        What it is, in a few words.
    default
        Its value [unit] where none is given; without one it must be given.

    Returns
    -------
    The field.
    """
    metadata = {"unit": unit, "low": low, "high": high, "meaning": meaning}
    return field(metadata=metadata) if default is None else field(default=default, metadata=metadata)


def from_file(kind: type[T], suffix: str, read: Callable[[Path], T], meaning: str) -> Any:
    """What a design has in a file: an object of a `kind`, or the name of a file, which ends in `suffix`, to read it."""
    return field(metadata={"kind": kind, "suffix": suffix, "read": read, "meaning": meaning})


def is_number(entry: Field[Any]) -> bool:
    """Whether an entry of a design is a `number`, not `from_file`."""
    return "unit" in entry.metadata


@dataclass_transform(frozen_default=True, field_specifiers=(number, from_file))
def design_numbers(kind: type[T]) -> type[T]:
    """Make a class of `number` and `from_file` fields a frozen dataclass that checks and reads them.

    Each field takes a number in its SI unit or text with a unit, such as "100 mm", and holds the SI number.
    Constructing the class refuses what is outside, with the number's name, its bounds and their unit.

    Parameters
    ----------
    kind
        The class.

    Returns
    -------
    The same class as a dataclass.
    """

    if not isinstance(kind, type):
        raise InputError(
            f"design_numbers: {type(kind).__name__} is given, no class; write @design_numbers above a class"
        )

    def check(self: Any) -> None:
        for entry in fields(self):
            check = design_number if is_number(entry) else _read
            object.__setattr__(self, entry.name, check(getattr(self, entry.name), entry))

    cast(Any, kind).__post_init__ = check
    return dataclass(frozen=True)(kind)


def _read(value: Any, entry: Field[Any]) -> Any:
    if isinstance(value, str | Path):
        return entry.metadata["read"](Path(value))
    if not isinstance(value, entry.metadata["kind"]):
        raise InputError(f"{entry.name}: give the name of a file that ends in {entry.metadata['suffix']}")
    return value


def design_number(value: float | str, entry: Field[Any]) -> float:
    """The SI number of a `number` field within its bounds; raises InputError, opened by the field's name."""
    unit, low, high = (entry.metadata[key] for key in ("unit", "low", "high"))
    try:
        result = quantity(value, unit)
    except InputError as error:
        raise InputError(f"{entry.name}: {error}") from None
    if not low <= result <= high:
        raise InputError(f"{entry.name}: {result:g} {unit} is outside {low:g} to {high:g} {unit}")
    return result
