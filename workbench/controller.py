"""What a controller is: the protocol that every file in controllers/ follows, and how one is made from a config."""

import math
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from importlib import import_module
from typing import Any, ClassVar, Protocol, cast

import control

from .errors import InputError, nearest
from .units import to_si


class Controller(Protocol):
    """A sampled controller. All signals SI; the command is -1..1.

    `measures` names the signals it needs, the controlled one first. A loop calls `reset` once, then in every period
    `compute` with what was just measured and `update` with the command that the guard let through.
    """

    measures: ClassVar[tuple[str, ...]]

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


def number(unit: str, low: float, high: float, meaning: str, default: float | None = None) -> Any:
    """A design number of a controller: SI unit, bounds [SI] that tuning may search, and its meaning."""
    metadata = {"unit": unit, "low": low, "high": high, "meaning": meaning}
    return field(metadata=metadata) if default is None else field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Recipe:
    """A named controller of a config: where its class is, and its design numbers in SI."""

    name: str
    use: str
    design: Any

    def make(self, period: float) -> Controller:
        """The controller for a control period [s]."""
        return cast(Controller, _load(self.use, self.name)(self.design, period))


def recipe(name: str, table: Mapping[str, Any], where: str) -> Recipe:
    """Read `use = "module:Class"` and the design numbers `{value, unit}`; raises InputError with `where`."""
    use = table.get("use")
    if not isinstance(use, str) or use.count(":") != 1:
        raise InputError(f'{where}: needs use = "module:Class", such as "controllers.p:P"')
    design = getattr(_load(use, where), "Design", None)
    if not (isinstance(design, type) and is_dataclass(design)):
        raise InputError(f'{where}: use = "{use}" is no controller: it has no dataclass Design')
    known = {entry.name: entry for entry in fields(design)}
    for key in table:
        if key != "use" and key not in known:
            raise InputError(f'{where}: unknown key "{key}"; {nearest(key, known)}')
    values = {key: _number(table[key], entry, f"{where}: {key}") for key, entry in known.items() if key in table}
    missing = [key for key, entry in known.items() if key not in table and entry.default is MISSING]
    if missing:
        entry = known[missing[0]]
        raise InputError(f"{where}: {missing[0]} is missing ({entry.metadata['meaning']}, in {entry.metadata['unit']})")
    return Recipe(name, use, design(**values))


def _number(entry: Any, spec: "Field[Any]", where: str) -> float:
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
