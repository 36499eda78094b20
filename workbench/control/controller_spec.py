"""How a controller is made from a config: its class by name, its design numbers, the compensators around it."""

from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from inspect import signature
from pathlib import Path
from typing import Any, TypeVar, cast

from ..base.errors import InputError, nearest
from ..base.signals import SIGNALS
from ..base.table import ConfigTable
from ..base.units import Spec
from ..rigs.linear_rig import LinearRig
from ..rigs.rig import Rig
from .compensators import Compensator, compensated, deflection, surrounded
from .load_class import absolute, load_class
from .measured_stiffness import MeasuredStiffnessShell, StiffnessMeter
from .protocol import Controller, design_number, is_number, number
from .shells import LoadCellShell

T = TypeVar("T")
_METHODS = {
    "reset": ("reference", "measurement", "command"),
    "compute": ("reference", "measurement"),
    "update": ("realised",),
}


@dataclass(frozen=True)
class _OfTheLoop:
    """What a controller's table has besides `use`, compensators and the numbers of its design."""

    stiffness: float = number("N/m", 1e3, 1e10, "stiffness of the specimen that the loop is designed on")
    softest: float = number("N/m", 1e3, 1e10, "of the specimens whose stiffness the loop measures")
    stiffest: float = number("N/m", 1e3, 1e10, "of the specimens whose stiffness the loop measures")
    computing_delay: float = number("s", 0.0, 0.1, "time from a sample to its command")


OF_THE_LOOP = {entry.name: entry for entry in fields(_OfTheLoop)}


@dataclass(frozen=True, repr=False)
class ControllerSpec:
    """A named controller: where its class is, its design numbers in SI, and the compensators around it.

    With a `stiffness` [N/m] the loop is on the load cell, of force over stiffness: the controller and every compensator
    see the reference as a deflection [m]. With `softest` and `stiffest` [N/m] besides, the loop measures the specimen's
    stiffness between them and scales itself: see measured_stiffness. `computing_delay` [s] is how long after a sample
    its command comes, where that is known; else the rig says it. `build` knows nothing of it. A law whose
    class says `of_linear_plants` is made as Law(design, period, plant), on the `plant` that the loop is on. `spec +
    compensator` is the same with a compensator around it.
    """

    name: str
    use: str
    design: Any
    compensators: tuple["ControllerSpec", ...] = ()
    stiffness: float | None = None
    computing_delay: float | None = None
    softest: float | None = None
    stiffest: float | None = None
    plant: LinearRig | None = field(default=None, compare=False)

    def knowing(self, rig: Rig) -> "ControllerSpec":
        """This controller for a loop on a rig: where that is a linear plant, a law of such plants is designed on it."""
        return replace(self, plant=rig) if isinstance(rig, LinearRig) else self

    def named(self, name: str) -> "ControllerSpec":
        """This controller under another name."""
        return replace(self, name=name)

    def on_load_cell(self, stiffness: float | str) -> "ControllerSpec":
        """This controller as a force loop on a specimen of a stiffness, in N/m or text such as "10 kN/mm"."""
        return replace(self, stiffness=design_number(stiffness, OF_THE_LOOP["stiffness"]))

    def __add__(self, compensator: "ControllerSpec") -> "ControllerSpec":
        if not isinstance(compensator, ControllerSpec):
            return NotImplemented
        if self.is_compensator or not compensator.is_compensator:
            raise InputError(f"{self.name} + {compensator.name}: add a compensator to a controller, not the reverse")
        name = f"{self.name}+{compensator.name}"
        return replace(self, name=name, compensators=(*self.compensators, compensator))

    @property
    def is_compensator(self) -> bool:
        """Whether it is a filter that stands beside a controller."""
        return hasattr(load_class(self.use, self.name), "into")

    def build(self, period: float) -> Controller:
        """The controller for a control period [s], its compensators around it from first to last.

        Raises InputError, with its name, for a design that is out of reach.
        """
        where = f"[controllers.{self.name}]"
        controller = cast(Controller, _made(self, period, where))
        if not self.is_compensator:
            check_controller(controller, where)
        if self.stiffness is not None:
            controller = self._on_load_cell(controller, self.stiffness, period)
        for part in self.compensators:
            controller = compensated(controller, _made(part, period, where))
        return controller if self.stiffness is None else surrounded(controller, deflection(self.stiffness, period))

    def _on_load_cell(self, controller: Controller, stiffness: float, period: float) -> Controller:
        """A controller of position on the load cell, scaled by the stiffness where that is measured."""
        loop = surrounded(controller, LoadCellShell(stiffness))
        if self.softest is None or self.stiffest is None:
            return loop
        meter = StiffnessMeter(self.softest, self.stiffest, period)
        return surrounded(loop, MeasuredStiffnessShell(stiffness, meter))

    def __repr__(self) -> str:
        """Class and numbers that are not at their default, part by part."""
        on_cell = "" if self.stiffness is None else f" on the load cell at {self.stiffness:g} N/m"
        calls = [_call(part) for part in (self, *self.compensators)]
        line = " + ".join(calls) + on_cell
        return line if len(line) <= 100 else "\n    + ".join(calls) + on_cell

    def __reduce__(self) -> tuple[Any, ...]:
        """By the entries of the design: another process may not have run the file of its class yet."""
        rest = self.compensators, self.stiffness, self.computing_delay, self.softest, self.stiffest, self.plant
        design = {entry.name: getattr(self.design, entry.name) for entry in fields(self.design)}
        return _restored, (self.name, self.use, design, *rest)


def _made(spec: ControllerSpec, period: float, where: str) -> Any:
    """The object of a class and its design; raises InputError, opened by `where`, where that cannot be made."""
    law = load_class(spec.use, spec.name)
    try:
        if not getattr(law, "of_linear_plants", False):
            return law(spec.design, period)
        if spec.plant is None:
            raise InputError("is designed on a linear plant; give the experiment a table [plant]")
        return law(spec.design, period, spec.plant)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    except Exception as error:
        what = f"{law.__name__}(design, period): {type(error).__name__}: {error}"
        raise InputError(f"{where}: {what}; correct its __init__") from error


def _restored(name: str, use: str, design: Mapping[str, Any], *rest: Any) -> ControllerSpec:
    return ControllerSpec(name, use, load_class(use, name).Design(**design), *rest)


def _call(spec: ControllerSpec) -> str:
    entries = [entry for entry in fields(spec.design) if getattr(spec.design, entry.name) != entry.default]
    numbers = (_entry(getattr(spec.design, entry.name), entry) for entry in entries)
    return f"{spec.use.rpartition(':')[2]}({', '.join(numbers)})"


def _entry(value: Any, entry: Field[Any]) -> str:
    return f"{entry.name}={value:g} {entry.metadata['unit']}" if is_number(entry) else str(value)


def controller_spec(name: str, table: ConfigTable, beside: Path | None = None) -> ControllerSpec:
    """The controller of a table with `use = "module:Class"` and its design numbers, `{value, unit}` or "3.7 1/m".

    `use = "file.py:Class"` names a file from the folder `beside`, that of the experiment (else the current one).
    `compensators` is a list of such tables, the first innermost; `stiffness` puts the loop on the load cell;
    `computing_delay` says what `jackbench time` measured. Raises InputError.
    """
    around = tuple(_part(name, part, Compensator, beside) for part in table.tables("compensators"))
    own = {key: entry for key, entry in table.values.items() if key != "compensators" and key not in OF_THE_LOOP}
    numbers = {key: _number(table, entry) for key, entry in OF_THE_LOOP.items() if key in table}
    _check_range(table, numbers)
    return replace(_part(table.named(name), table.replaced(own), Controller, beside), compensators=around, **numbers)


def _check_range(table: ConfigTable, numbers: Mapping[str, float]) -> None:
    """Raises InputError for a range of stiffnesses that is none, or that stands alone."""
    given = [key for key in ("softest", "stiffest") if key in numbers]
    if len(given) == 1 or (given and "stiffness" not in numbers):
        what = "a loop that measures its specimen's stiffness needs stiffness, softest and stiffest; give all three"
        raise table.complaint(given[0], what)
    if given and not numbers["softest"] < numbers["stiffest"]:
        raise table.complaint("softest", "must be below stiffest")


def _part(name: str, table: ConfigTable, kind: type, beside: Path | None) -> ControllerSpec:
    """A controller or a compensator, by itself."""
    use, what = table.values.get("use"), kind.__name__.lower()
    if not isinstance(use, str) or ":" not in use:
        raise table.error('needs use = "module:Class", such as "controllers.p:P"')
    use, where = absolute(use, beside), str(table.place)
    law = load_class(use, where)
    design = design_class(law, f'{where}: use = "{use}"', what)
    if hasattr(law, "into") is not (kind is Compensator):
        other = "compensator; name it under compensators" if kind is Controller else "controller, and stands by itself"
        raise table.complaint("use", f'"{use}" is a {other}')
    numbers = table.replaced({key: entry for key, entry in table.values.items() if key != "use"})
    return ControllerSpec(name, use, read_numbers(design, numbers, beside or Path()))


def design_class(law: Any, where: str, what: str = "controller") -> type:
    """The dataclass of a law's design numbers; raises InputError, opened by `where`, where it has none."""
    design = getattr(law, "Design", None)
    if not (isinstance(design, type) and is_dataclass(design)):
        raise InputError(f"{where} is no {what}: it has no dataclass Design")
    return design


def read_numbers(kind: type[T], table: ConfigTable, beside: Path | None = None) -> T:
    """A dataclass of `number` fields from a table of `{value, unit}` or text such as "10 mm"; what is in a file is read
    from the folder `beside`. Raises InputError."""
    known = {entry.name: entry for entry in fields(cast(Any, kind))}
    table.allow(*known)
    needed = {key: entry for key, entry in known.items() if key in table or entry.default is MISSING}
    return kind(**{key: _value(table, entry, beside or Path()) for key, entry in needed.items()})


def _value(table: ConfigTable, entry: Field[Any], beside: Path) -> Any:
    if is_number(entry):
        return _number(table, entry)
    given = table.values.get(entry.name)
    by_name = given is None or isinstance(given, str)
    return table.path(entry.name, beside, entry.metadata["suffix"]) if by_name else given


def _number(table: ConfigTable, entry: Field[Any]) -> float:
    """The SI number of a field, within its bounds."""
    return table.quantity(entry.name, Spec(**entry.metadata))


def check_controller(controller: Any, where: str) -> None:
    """Raises InputError, opened by `where`, with class and method, for what no loop can run."""
    name = type(controller).__name__
    for method, arguments in _METHODS.items():
        call = f"{method}({', '.join(arguments)})"
        if not callable(getattr(controller, method, None)):
            raise InputError(f"{where}: {name} has no method {method}; give it {call}")
        try:
            signature(getattr(controller, method)).bind(*arguments)
        except TypeError as error:
            raise InputError(f"{where}: {name}.{method}: {error}; a loop calls {call}") from None
    measures = getattr(controller, "measures", None)
    if not isinstance(measures, tuple | list) or not measures or not all(isinstance(s, str) for s in measures):
        raise InputError(
            f"{where}: {name}.measures: {measures!r}; write a tuple of the signals that it needs, the controlled one "
            'first, such as ("position",)'
        )
    for signal in measures:
        if signal not in SIGNALS:
            raise InputError(f'{where}: {name}.measures: no signal "{signal}"; {nearest(signal, list(SIGNALS))}')
