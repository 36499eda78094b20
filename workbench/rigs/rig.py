"""A rig: every number of plant, limits and sensors once, with its value, unit, source and bounds.

A rig file is TOML with the tables `supply`, `oil`, `valve` (`kind`, `corrector`), `jack` (`kind`), `load`, `limits`,
`control`, `sensors.NAME` and `effects`; `effect_files` lists Python files beside it with a user's own effects. A number
is `{value = 2.29, unit = "mm", source = "...", bounds = [2.2, 2.4]}`; `bounds` (in the same unit) are how far a fit may
move it. Everything is SI once read.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import tomli_w

from ..base.errors import InputError, nearest
from ..base.signals import SIGNALS
from ..base.toml import check_keys, read_toml
from ..base.units import from_si, to_si
from . import schema
from .jack import JACKS, JackKind
from .schema import Spec
from .valve import VALVES, ValveKind

TITLES = ("name", "title", "source", "recordings", "effect_files")
NO_CORRECTOR = "p"  # of a valve whose kind has no spool loop to choose
TABLES = ("supply", "oil", "valve", "jack", "load", "limits", "control", "sensors", "effects")


@dataclass(frozen=True)
class Number:
    """A number with its SI value, the unit it was written in, where it comes from and its declared range [SI]."""

    name: str
    value: float
    unit: str
    si: str
    source: str
    low: float | None = None
    high: float | None = None

    @property
    def shown(self) -> float:
        """The value in the unit it was written in."""
        return float(from_si(self.value, self.unit, self.si))


@dataclass(frozen=True)
class Sensor:
    """White noise (standard deviation) and resolution (quantum) of a sensor, in the signal's SI unit."""

    noise: float
    resolution: float


@dataclass(frozen=True)
class EffectUse:
    """An effect that this rig declares: its name, which formula, and its numbers."""

    name: str
    formula: str
    numbers: Mapping[str, Number]


@dataclass(frozen=True)
class Rig:
    """All that is known of a rig. `numbers` are those of the plant; `limits` and `period` those of its controller.

    `effect_files` are Python files with effects that the library lacks, by absolute path; see plant/effects.
    """

    name: str
    title: str
    source: str
    valve: str
    corrector: str
    jack: str
    numbers: Mapping[str, Number]
    limits: Mapping[str, Number]
    period: Number
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    effects: tuple[EffectUse, ...] = ()
    recordings: str = ""
    effect_files: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> float:
        """SI value of a plant number."""
        return self.numbers[name].value

    @property
    def valve_kind(self) -> ValveKind:
        """What is known of this kind of valve; its equations are in plant/valve."""
        return VALVES[self.valve]

    @property
    def jack_kind(self) -> JackKind:
        """What is known of this kind of jack."""
        return JACKS[self.jack]

    @property
    def areas(self) -> tuple[float, float]:
        """Piston areas [m^2] of side A and side B."""
        a, b = self.jack_kind.areas
        return self[a], self[b]

    @property
    def dead_volumes(self) -> tuple[float, float]:
        """Dead volumes [m^3] of side A and side B."""
        a, b = self.jack_kind.dead_volumes
        return self[a], self[b]

    def limit(self, name: str) -> float:
        """SI value of a limit: stroke [m], speed [m/s], force [N] or command_rate [1/s]."""
        return self.limits[name].value

    def with_values(self, **values: float) -> "Rig":
        """A copy with other SI values; a value beyond its fit bounds takes them along in proportion.

        Raises InputError for an unknown name or an impossible value.
        """
        numbers = dict(self.numbers)
        specs = number_specs(self.valve, self.corrector, self.jack)
        for name, value in values.items():
            if name not in numbers:
                raise InputError(f'rig {self.name}: no number "{name}"; {nearest(name, numbers)}')
            _check_range(value, specs[name], f"rig {self.name}: {name}")
            numbers[name] = _moved(numbers[name], float(value))
        return replace(self, numbers=numbers)


def _moved(number: Number, value: float) -> Number:
    """The number with another value; a range that it leaves goes with it, in proportion."""
    if number.low is None or number.high is None or number.low <= value <= number.high:
        return replace(number, value=value)
    shift = value / number.value if number.value else 1.0
    low, high = sorted((number.low * shift, number.high * shift))
    return replace(number, value=value, low=min(low, value), high=max(high, value))


def number_specs(valve: str, corrector: str, jack: str) -> dict[str, Spec]:
    """Every plant number that a rig of these kinds has, by name."""
    tables = (schema.SUPPLY, schema.OIL, VALVES[valve].schema(corrector), JACKS[jack].numbers, schema.LOAD)
    return {name: spec for table in tables for name, spec in table.items()}


def bundled() -> list[str]:
    """Names of the rigs that come with jackbench."""
    folder = files("workbench") / "rigs"
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_rig(name: str | Path, beside: Path | None = None) -> Rig:
    """A bundled rig by name, or a rig file by path (relative to `beside`). Raises InputError with file and row."""
    if str(name) in bundled():
        return _parse(Path(str(files("workbench") / "rigs" / f"{name}.toml")), str(name))
    path = (beside / name) if beside else Path(name)
    if path.suffix != ".toml":
        hint = nearest(str(name), bundled())
        end = "" if hint.endswith("?") else "."
        raise InputError(f'no bundled rig "{name}"; {hint}{end} A rig file ends in .toml')
    return _parse(path, str(path))


def _parse(path: Path, shown: str) -> Rig:
    table = read_toml(path)
    check_keys(table, TITLES + TABLES, shown)
    read = _Reader(path, shown, table)
    valve = VALVES[read.kind("valve", "kind", VALVES)]
    corrector = read.kind("valve", "corrector", valve.correctors) if valve.correctors else NO_CORRECTOR
    jack = JACKS[read.kind("jack", "kind", JACKS)]
    numbers = {
        **read.numbers("supply", schema.SUPPLY),
        **read.numbers("oil", schema.OIL),
        **read.numbers("valve", valve.schema(corrector), ("kind", "corrector")),
        **read.numbers("jack", jack.numbers, ("kind",)),
        **read.numbers("load", schema.LOAD),
    }
    return Rig(
        name=str(table.get("name", path.stem)),
        title=str(table.get("title", "")),
        source=str(table.get("source", "")),
        valve=valve.name,
        corrector=corrector,
        jack=jack.name,
        numbers=numbers,
        limits=read.numbers("limits", schema.LIMITS),
        period=read.numbers("control", schema.CONTROL)["period"],
        sensors=read.sensors(),
        effects=read.effects(),
        recordings=str(table.get("recordings", "")),
        effect_files=read.effect_files(path.parent),
    )


def _check_range(value: float, spec: Spec, where: str) -> None:
    if not spec.low <= value <= spec.high:
        raise InputError(f"{where}: {value:g} {spec.unit} is not possible ({spec.low:g} to {spec.high:g} {spec.unit})")


class _Reader:
    """Reads the tables of one rig file, naming file and row in every error."""

    def __init__(self, path: Path, shown: str, table: Mapping[str, Any]) -> None:
        self.shown = shown
        self.table = table
        self.rows = path.read_text(encoding="utf-8").splitlines()

    def where(self, section: str, key: str) -> str:
        """ "file: line N: section.key", or without the line where the row can not be found."""
        inside = False
        for number, row in enumerate(self.rows, 1):
            text = row.strip()
            if text.startswith("["):
                inside = text.strip("[] ").split("#")[0].strip("[] ") == section
            elif inside and text.split("=")[0].strip().strip('"') == key:
                return f"{self.shown}: line {number}: {section}.{key}"
        return f"{self.shown}: {section}.{key}"

    def section(self, name: str) -> Mapping[str, Any]:
        """A table that must be there."""
        part = self.table.get(name)
        if not isinstance(part, Mapping):
            raise InputError(f"{self.shown}: table [{name}] is missing; add it")
        return part

    def mapping(self, name: str) -> Mapping[str, Any]:
        """A table that may be absent."""
        part = self.table.get(name, {})
        if not isinstance(part, Mapping):
            raise InputError(f"{self.shown}: {name} must be a table; write [{name}]")
        return part

    def effects(self) -> tuple[EffectUse, ...]:
        """The list of tables `[[effects]]`."""
        uses = self.table.get("effects", [])
        if not isinstance(uses, list):
            raise InputError(f"{self.shown}: effects must be a list of tables; write [[effects]]")
        return tuple(self.effect(use) for use in uses)

    def effect_files(self, beside: Path) -> tuple[str, ...]:
        """Paths of a user's effects; what is in them is checked where effects are known."""
        files = self.table.get("effect_files", [])
        if not isinstance(files, list) or not all(isinstance(name, str) for name in files):
            raise InputError(f'{self.shown}: effect_files must be a list of paths; write effect_files = ["mine.py"]')
        return tuple(str((beside / name).resolve()) for name in files)

    def kind(self, section: str, key: str, known: Mapping[str, Any]) -> str:
        """A word out of a list."""
        word = self.section(section).get(key)
        if not isinstance(word, str) or word not in known:
            raise InputError(f'{self.where(section, key)} = "{word}": {nearest(str(word), known)}')
        return str(word)

    def numbers(self, section: str, specs: Mapping[str, Spec], words: tuple[str, ...] = ()) -> dict[str, Number]:
        """All numbers of a table; a missing, unknown or impossible one raises."""
        part = self.section(section)
        for key in part:
            if key not in specs and key not in words:
                raise InputError(f"{self.where(section, key)}: unknown key, {nearest(key, specs)}")
        missing = [name for name in specs if name not in part]
        if missing:
            spec = specs[missing[0]]
            raise InputError(f"{self.shown}: {section}.{missing[0]} is missing ({spec.meaning}, in {spec.unit})")
        return {name: self.number(part[name], name, spec, self.where(section, name)) for name, spec in specs.items()}

    def number(self, entry: Any, name: str, spec: Spec, where: str) -> Number:
        """One `{value, unit, source, bounds}`."""
        if not isinstance(entry, Mapping):
            raise InputError(f'{where}: write {{value = ..., unit = "{spec.unit}", source = "..."}}')
        check_keys(entry, ("value", "unit", "source", "bounds"), where)
        unit = entry.get("unit")
        if not isinstance(unit, str):
            raise InputError(f'{where}: no unit; write unit = "{spec.unit}" or one that converts to it')
        limits = entry.get("bounds", [])
        values: list[Any] = [entry.get("value"), *(limits if isinstance(limits, list) else [None])]
        if any(isinstance(v, bool) or not isinstance(v, int | float) for v in values) or len(values) not in (1, 3):
            raise InputError(f"{where}: value must be a number, and bounds two of them")
        try:
            value, *bounds = (float(to_si(v, unit, spec.unit)) for v in values)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        _check_range(value, spec, where)
        if bounds and not bounds[0] <= value <= bounds[1]:
            raise InputError(f"{where}: the value is outside its own bounds")
        low, high = bounds or (None, None)
        return Number(name, value, unit, spec.unit, str(entry.get("source", "")), low, high)

    def sensors(self) -> dict[str, Sensor]:
        """Tables `[sensors.NAME]` with `noise` and `resolution`."""
        found = {}
        for name, part in self.mapping("sensors").items():
            section = f"sensors.{name}"
            if not isinstance(part, Mapping):
                raise InputError(f"{self.shown}: {section}: write a table [{section}] with noise and resolution")
            if name not in SIGNALS:
                raise InputError(f"{self.shown}: [{section}]: no such signal, {nearest(name, SIGNALS)}")
            check_keys(part, ("noise", "resolution"), f"{self.shown}: [{section}]")
            spec = Spec(SIGNALS[name].si, 0.0, float("inf"), "")
            values = [
                self.number(part.get(key), key, spec, self.where(section, key)).value for key in ("noise", "resolution")
            ]
            found[name] = Sensor(*values)
        return found

    def effect(self, use: Any) -> EffectUse:
        """One `[[effects]]` entry; which names and numbers exist is checked where effects are known."""
        if not isinstance(use, Mapping) or not isinstance(use.get("name"), str):
            raise InputError(f'{self.shown}: [[effects]] needs name = "..." and formula = "..."')
        where = f"{self.shown}: effect {use['name']}"
        numbers = {}
        for key, entry in use.items():
            if key in ("name", "formula"):
                continue
            unit = entry.get("unit") if isinstance(entry, Mapping) else None
            spec = Spec(str(unit), -float("inf"), float("inf"), "")
            numbers[key] = self.number(entry, key, spec, f"{where}: {key}")
        return EffectUse(use["name"], str(use.get("formula", "")), numbers)


def rig_table(rig: Rig) -> dict[str, Any]:
    """The rig as the tables of a rig file, each number in the unit it was written in."""
    sections: dict[str, dict[str, Any]] = {
        "supply": dict.fromkeys(schema.SUPPLY),
        "oil": dict.fromkeys(schema.OIL),
        "valve": dict.fromkeys(rig.valve_kind.schema(rig.corrector)),
        "jack": dict.fromkeys(rig.jack_kind.numbers),
        "load": dict.fromkeys(schema.LOAD),
    }
    filled: dict[str, dict[str, Any]] = {
        section: {name: _entry(rig.numbers[name]) for name in names} for section, names in sections.items()
    }
    corrector = {"corrector": rig.corrector} if rig.valve_kind.correctors else {}
    filled["valve"] = {"kind": rig.valve, **corrector, **filled["valve"]}
    filled["jack"] = {"kind": rig.jack, **filled["jack"]}
    titles = {"name": rig.name, "title": rig.title, "source": rig.source, "recordings": rig.recordings}
    sensors = {name: _sensor_entry(name, sensor) for name, sensor in rig.sensors.items()}
    effects = [
        {"name": use.name, "formula": use.formula, **{key: _entry(number) for key, number in use.numbers.items()}}
        for use in rig.effects
    ]
    return {
        **{key: text for key, text in titles.items() if text},
        **({"effect_files": list(rig.effect_files)} if rig.effect_files else {}),
        **filled,
        "limits": {name: _entry(number) for name, number in rig.limits.items()},
        "control": {"period": _entry(rig.period)},
        "sensors": sensors,
        **({"effects": effects} if effects else {}),
    }


def save_rig(rig: Rig, path: Path) -> None:
    """Write a rig file; `load_rig` reads back the same rig."""
    path.write_text(rig_text(rig), encoding="utf-8")


def rig_text(rig: Rig) -> str:
    """The text of a rig file."""
    return tomli_w.dumps(rig_table(rig))


def _entry(number: Number) -> dict[str, Any]:
    def shown(value: float) -> float:
        return float(f"{float(from_si(value, number.unit, number.si)):.14g}")

    entry: dict[str, Any] = {"value": shown(number.value), "unit": number.unit}
    if number.source:
        entry["source"] = number.source
    if number.low is not None and number.high is not None:
        entry["bounds"] = [shown(number.low), shown(number.high)]
    return entry


def _sensor_entry(name: str, sensor: Sensor) -> dict[str, Any]:
    unit = SIGNALS[name].si
    return {key: {"value": getattr(sensor, key), "unit": unit} for key in ("noise", "resolution")}
