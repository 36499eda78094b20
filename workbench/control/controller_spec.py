"""How a controller is made from a config: its class by name, its design numbers, the compensators around it."""

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from importlib import import_module
from typing import Any, TypeVar, cast

from ..base.errors import InputError
from ..base.toml import check_keys
from ..base.units import to_si
from .compensators import Compensated, Compensator, Deflection, OnLoadCell
from .protocol import Controller, number

T = TypeVar("T")
_OF_THE_LOOP = ("compensators", "stiffness", "computing_delay")
_COMPUTING = number("s", 0.0, 0.1, "time from a sample to its command")
_STIFFNESS = number("N/m", 1e3, 1e10, "stiffness of the specimen that the loop is designed on")


@dataclass(frozen=True)
class ControllerSpec:
    """A named controller of a config: where its class is, its design numbers in SI, and the compensators around it.

    With a `stiffness` [N/m] the loop is on the load cell, of force over stiffness: the controller and every compensator
    see the reference as a deflection [m]. `computing_delay` [s] is how long after a sample its command comes: what the
    rig's computer needs, which `build` knows nothing of.
    """

    name: str
    use: str
    design: Any
    compensators: tuple["ControllerSpec", ...] = ()
    stiffness: float | None = None
    computing_delay: float = 0.0

    def expecting_its_delay(self) -> "ControllerSpec":
        """The same for a loop that has the computing delay: a design with the number `delay` has it added."""
        if not hasattr(self.design, "delay"):
            return self
        return replace(self, design=replace(self.design, delay=self.design.delay + self.computing_delay))

    def build(self, period: float) -> Controller:
        """The controller for a control period [s], its compensators around it from first to last.

        Raises InputError, with its name, for a design that is out of reach.
        """
        try:
            made = cast(Controller, _load(self.use, self.name)(self.design, period))
        except InputError as error:
            raise InputError(f"[controllers.{self.name}]: {error}") from None
        if self.stiffness is not None:
            made = OnLoadCell(made, self.stiffness)
        for part in self.compensators:
            made = Compensated(made, cast(Compensator, _load(part.use, part.name)(part.design, period)))
        return made if self.stiffness is None else Compensated(made, Deflection(self.stiffness, period))


def controller_spec(name: str, table: Mapping[str, Any], where: str) -> ControllerSpec:
    """The controller of a table with `use = "module:Class"` and its design numbers `{value, unit}`.

    `compensators` is a list of such tables, the first innermost; `stiffness` puts the loop on the load cell;
    `computing_delay` says what `jackbench time` measured. Raises InputError, opened by `where`.
    """
    stack, stiffness, computing = (table.get(key) for key in ("compensators", "stiffness", "computing_delay"))
    stack = [] if stack is None else stack
    if not isinstance(stack, list) or not all(isinstance(part, Mapping) for part in stack):
        raise InputError(f"{where}: compensators must be a list of tables; write [[controllers.{name}.compensators]]")
    around = (_part(name, part, f"{where}: compensator {i + 1}", Compensator) for i, part in enumerate(stack))
    own = {key: entry for key, entry in table.items() if key not in _OF_THE_LOOP}
    return replace(
        _part(name, own, where, Controller),
        compensators=tuple(around),
        stiffness=None if stiffness is None else _number(stiffness, _STIFFNESS, f"{where}: stiffness"),
        computing_delay=0.0 if computing is None else _number(computing, _COMPUTING, f"{where}: computing_delay"),
    )


def _part(name: str, table: Mapping[str, Any], where: str, kind: type) -> ControllerSpec:
    """A controller or a compensator, by itself."""
    use, what = table.get("use"), kind.__name__.lower()
    if not isinstance(use, str) or use.count(":") != 1:
        raise InputError(f'{where}: needs use = "module:Class", such as "controllers.p:P"')
    found = _load(use, where)
    design = getattr(found, "Design", None)
    if not (isinstance(design, type) and is_dataclass(design)):
        raise InputError(f'{where}: use = "{use}" is no {what}: it has no dataclass Design')
    if hasattr(found, "into") is not (kind is Compensator):
        other = "compensator; name it under compensators" if kind is Controller else "controller, and stands by itself"
        raise InputError(f'{where}: use = "{use}" is a {other}')
    return ControllerSpec(
        name, use, read_numbers(design, {key: entry for key, entry in table.items() if key != "use"}, where)
    )


def read_numbers(kind: type[T], table: Mapping[str, Any], where: str) -> T:
    """A dataclass of `number` fields from a table of `{value, unit}`; raises InputError, opened by `where`."""
    known = {entry.name: entry for entry in fields(cast(Any, kind))}
    check_keys(table, known, where)
    values = {key: _number(table[key], entry, f"{where}: {key}") for key, entry in known.items() if key in table}
    missing = [key for key, entry in known.items() if key not in table and entry.default is MISSING]
    if missing:
        entry = known[missing[0]]
        raise InputError(f"{where}: {missing[0]} is missing ({entry.metadata['meaning']}, in {entry.metadata['unit']})")
    return kind(**values)


def _number(entry: Any, spec: Any, where: str) -> float:
    unit = spec.metadata["unit"]
    if not isinstance(entry, Mapping) or not isinstance(entry.get("unit"), str) or isinstance(entry.get("value"), bool):
        raise InputError(f'{where}: write {{value = ..., unit = "{unit}"}}')
    if not isinstance(entry.get("value"), int | float) or not math.isfinite(entry["value"]):
        raise InputError(f"{where}: value must be a finite number")
    try:
        value = float(to_si(entry["value"], entry["unit"], unit))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    low, high = spec.metadata["low"], spec.metadata["high"]
    if not low <= value <= high:
        raise InputError(f"{where}: {value:g} {unit} is outside {low:g} to {high:g} {unit}")
    return value


def _load(use: str, where: str) -> Any:
    module, name = use.split(":")
    try:
        found = getattr(import_module(module), name)
    except (ImportError, TypeError, ValueError) as error:
        raise InputError(f'{where}: use = "{use}": {error}; write the module as Python imports it') from None
    except AttributeError:
        raise InputError(f'{where}: use = "{use}": module {module} has no class {name}') from None
    return found
