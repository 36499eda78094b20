"""A rig: every number of plant, limits and sensors once, with its value, unit, source and bounds.

A rig file is TOML with the tables `supply`, `oil`, `valve` (`kind`, `corrector`), `jack` (`kind`), `load`, `limits`,
`control`, `sensors.NAME`, `effects` and `sessions.NAME`; `effect_files` lists Python files beside it with a user's own
effects. A number is `{value = 2.29, unit = "mm", source = "...", bounds = [2.2, 2.4]}`; `bounds` (in the same unit) are
how far a fit may move it, `interval` within what a fit knows it (95 %). A session has numbers of the plant that were
others in the records of a campaign's session of that name. Everything is SI once read.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from ..base.columns import lookup
from ..base.errors import InputError, nearest
from ..base.signals import SIGNALS, Signal
from ..base.table import Table
from ..base.toml import read_toml
from ..base.toml_text import toml_text
from ..base.units import Spec, from_si, to_si
from . import schema
from .jack import JACKS, JackKind
from .summary import html_table, summary
from .together import check_speed_guard, check_together
from .valve import VALVES, ValveKind

TITLES = ("name", "title", "source", "recordings", "effect_files")
NO_CORRECTOR = "p"  # of a valve whose kind has no spool loop to choose
TABLES = ("supply", "oil", "valve", "jack", "load", "limits", "control", "sensors", "effects", "sessions")


@dataclass(frozen=True)
class Number:
    """A number with its SI value, the unit it was written in, where it comes from, its declared range [SI], and the
    interval [SI] in which a fit knows it."""

    name: str
    value: float
    unit: str
    si: str
    source: str
    low: float | None = None
    high: float | None = None
    interval: tuple[float, float] | None = None

    @property
    def uncertain(self) -> tuple[float, float] | None:
        """Between what it lies, SI: the interval of a fit, or else the declared range."""
        if self.interval is not None or self.low is None or self.high is None:
            return self.interval
        return self.low, self.high

    @property
    def shown(self) -> float:
        """The value in the unit it was written in."""
        return float(from_si(self.value, self.unit, self.si))


COMPUTING_DELAY = Number("computing_delay", 3e-4, "ms", "s", "taken where a rig declares none")


@dataclass(frozen=True)
class Sensor:
    """White noise (standard deviation) and resolution (quantum) of a sensor, in the signal's SI unit."""

    noise: float
    resolution: float

    @property
    def scatter(self) -> float:
        """What two readings of one value may differ by: six standard deviations of their difference."""
        return 6 * math.sqrt(2) * self.noise


@dataclass(frozen=True)
class EffectUse:
    """An effect that this rig declares: its name, which formula, and its numbers."""

    name: str
    formula: str
    numbers: Mapping[str, Number]


@dataclass(frozen=True)
class Rig:
    """All that is known of a rig. `numbers` are those of the plant; `limits`, `period` and `computing_delay`, from a
    sample to its command, those of its controller, with the `deadline` of what computes; `stop` what its guard does
    after a trip.

    `sessions` are numbers of the plant that were others in the records of a campaign's session, by its name.
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
    sessions: Mapping[str, Mapping[str, Number]] = field(default_factory=dict)
    recordings: str = ""
    effect_files: tuple[str, ...] = ()
    computing_delay: Number = COMPUTING_DELAY
    stop: str = schema.STOPS[0]
    deadline: Number | None = None

    def __getitem__(self, name: str) -> float:
        """SI value of a plant number. Raises KeyError that names the nearest there is."""
        return lookup(self.numbers, name, f"number of rig {self.name}").value

    def __repr__(self) -> str:
        """Three lines: title, kinds of valve and jack, and the numbers that tell its size."""
        return summary(self)

    def _repr_html_(self) -> str:
        """In a notebook: every number with unit, bounds, meaning and source."""
        return html_table(self)

    def signal(self, name: str) -> Signal:
        """A signal of its own by name, with its units."""
        return SIGNALS[name]

    @property
    def specs(self) -> Mapping[str, Spec]:
        """Unit, possible range and meaning of every number of the plant."""
        return number_specs(self.valve, self.corrector, self.jack)

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

    @property
    def kind(self) -> str:
        """What rigs of a set share: the names of their numbers, and effects with their formulas."""
        return f"{sorted(self.numbers)} {[(use.name, use.formula) for use in self.effects]}"

    @property
    def control(self) -> tuple[Number, ...]:
        """What is declared of its controller: period, computing delay, and the deadline where there is one."""
        return (self.period, self.computing_delay, *((self.deadline,) if self.deadline else ()))

    @property
    def middle(self) -> float:
        """Position [m] of the middle of the stroke."""
        return self["xmid"]

    @property
    def specimen_stiffness(self) -> float:
        """Stiffness [N/m] of the specimen, 0 without one."""
        return self["ks"]

    @property
    def nyquist(self) -> float:
        """Half of the control rate [Hz]: no loop plays or answers a faster sine."""
        return 0.5 / self.period.value

    @property
    def is_jack(self) -> bool:
        """Whether it has chambers and a stroke over which loops differ."""
        return True

    @property
    def takes_load(self) -> bool:
        """Whether a force can push at it."""
        return True

    def table(self) -> dict[str, Any]:
        """As the tables of a rig file."""
        return _rig_table(self)

    def limit(self, name: str) -> float:
        """SI value of a limit: stroke [m], speed [m/s], force [N] or command_rate [1/s]; not of an optional one."""
        return self.limits[name].value

    def in_session(self, name: str | None) -> "Rig":
        """The rig as it was in a session; as it is where it has no numbers for that."""
        return replace(self, numbers={**self.numbers, **self.sessions.get(name or "", {})}, sessions={})

    def with_values(self, **values: float) -> "Rig":
        """A copy with other SI values; a value beyond its fit bounds or interval takes them along in proportion.

        Raises InputError for an unknown name or an impossible value.
        """
        numbers = dict(self.numbers)
        specs = self.specs
        for name, value in values.items():
            if name not in numbers:
                raise InputError(f'rig {self.name}: no number "{name}"; {nearest(name, numbers)}')
            if problem := specs[name].problem(value):
                raise InputError(f"rig {self.name}: {name}: {problem}")
            numbers[name] = _moved(numbers[name], float(value))
        return replace(self, numbers=numbers)


def _moved(number: Number, value: float) -> Number:
    """The number with another value; a range that it leaves goes with it, in proportion."""
    shift = value / number.value if number.value else 1.0

    def moved(low: float, high: float) -> tuple[float, float]:
        if low <= value <= high:
            return low, high
        low, high = sorted((low * shift, high * shift))
        return min(low, value), max(high, value)

    ends = None if number.low is None or number.high is None else moved(number.low, number.high)
    interval = None if number.interval is None else moved(*number.interval)
    low, high = ends or (number.low, number.high)
    return replace(number, value=value, low=low, high=high, interval=interval)


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
        return _read(Path(str(files("workbench") / "rigs" / f"{name}.toml")), str(name))
    path = (beside / name) if beside else Path(name)
    if path.suffix != ".toml":
        hint = nearest(str(name), bundled())
        end = "" if hint.endswith("?") else "."
        raise InputError(f'no bundled rig "{name}"; {hint}{end} A rig file ends in .toml')
    return _read(path, str(path))


def _read(path: Path, shown: str) -> Rig:
    top = read_toml(path, shown)
    from .linear_file import FORMS, read_linear_rig

    if any(form in top for form in FORMS):
        return read_linear_rig(top, path.stem)
    top.allow(*TITLES, *TABLES)
    valve, jack = top.table("valve"), top.table("jack")
    valve_kind, jack_kind = VALVES[valve.word("kind", VALVES)], JACKS[jack.word("kind", JACKS)]
    corrector = valve.word("corrector", valve_kind.correctors) if valve_kind.correctors else NO_CORRECTOR
    numbers = {
        **_numbers(top.table("supply"), schema.SUPPLY),
        **_numbers(top.table("oil"), schema.OIL),
        **_numbers(valve, valve_kind.schema(corrector), "kind", "corrector"),
        **_numbers(jack, jack_kind.numbers, "kind"),
        **_numbers(top.table("load"), schema.LOAD),
    }
    limits = _numbers(top.table("limits"), schema.LIMITS, "stop")
    sensors = read_sensors(top.optional_table("sensors"))
    check_together(top, numbers, limits)
    control = top.table("control", *schema.CONTROL)
    period = read_number(control, "period", schema.CONTROL["period"])
    check_speed_guard(top, sensors, limits["speed"].value * period.value)
    return Rig(
        name=top.named(top.text("name", path.stem)),
        title=top.text("title", ""),
        source=top.text("source", ""),
        valve=valve_kind.name,
        corrector=corrector,
        jack=jack_kind.name,
        numbers=numbers,
        limits=limits,
        period=period,
        sensors=sensors,
        effects=tuple(_effect(use) for use in top.tables("effects")),
        sessions=_sessions(top.optional_table("sessions"), number_specs(valve_kind.name, corrector, jack_kind.name)),
        recordings=top.text("recordings", ""),
        effect_files=tuple(str((path.parent / file).resolve()) for file in top.words("effect_files", "mine.py", ())),
        computing_delay=_computing_delay(control),
        stop=_stop(top.table("limits")),
        deadline=_deadline(control),
    )


def _stop(limits: Table) -> str:
    if "stop" not in limits:
        return schema.STOPS[0]
    if limits.text("stop") == "depressurise":
        raise limits.complaint("stop", f"no plant has a valve for that; possible: {', '.join(schema.STOPS)}")
    return limits.word("stop", schema.STOPS)


def _computing_delay(control: Table) -> Number:
    name = COMPUTING_DELAY.name
    return read_number(control, name, schema.CONTROL[name]) if name in control else COMPUTING_DELAY


def _deadline(control: Table) -> Number | None:
    return read_number(control, "deadline", schema.CONTROL["deadline"]) if "deadline" in control else None


def read_number(table: Table, name: str, spec: Spec, source: str = "") -> Number:
    """One `{value, unit, source, bounds}` of a table; `source` is where it comes from if it does not say."""
    if not isinstance(table.values.get(name), Mapping | None):
        raise table.complaint(name, f'write {{value = ..., unit = "{spec.unit}", source = "..."}}')
    value = table.quantity(name, spec, "source", "bounds", "interval")
    entry = table.table(name)
    low, high = _ends(entry, "bounds", value, spec.unit) if "bounds" in entry else (None, None)
    interval = _ends(entry, "interval", value, spec.unit) if "interval" in entry else None
    return Number(name, value, entry.text("unit", ""), spec.unit, entry.text("source", source), low, high, interval)


def _ends(entry: Table, key: str, value: float, si: str) -> tuple[float, float]:
    ends = entry.numbers(key, "[low, high]")
    if len(ends) != 2:
        raise entry.complaint(key, "must be two numbers, [low, high], in the number's unit")
    low, high = (float(to_si(end, entry.text("unit", ""), si)) for end in ends)
    if not low <= value <= high:
        raise entry.complaint(key, f"the value is outside its own {key}")
    return low, high


def _numbers(table: Table, specs: Mapping[str, Spec], *words: str) -> dict[str, Number]:
    """All numbers of a table; a missing one that is not optional, an unknown or impossible one raises."""
    table.allow(*specs, *words)
    given = {name: spec for name, spec in specs.items() if name in table or name not in schema.OPTIONAL}
    return {name: read_number(table, name, spec) for name, spec in given.items()}


def read_sensors(table: Table, signals: Mapping[str, Signal] = SIGNALS) -> dict[str, Sensor]:
    """Tables `[sensors.NAME]` with `noise` and `resolution`, in units of the `signals`."""
    sensors = {}
    for name in table.allow(*signals):
        part = table.table(name, "noise", "resolution")
        spec = Spec(signals[name].si, 0.0, float("inf"), "")
        sensors[name] = Sensor(*(part.quantity(key, spec, "source") for key in ("noise", "resolution")))
    return sensors


def _effect(use: Table) -> EffectUse:
    """One `[[effects]]` entry; which names and numbers exist is checked where effects are known."""
    name, numbers = use.text("name"), {}
    for key in use:
        if key not in ("name", "formula"):
            unit = use.table(key).text("unit")
            numbers[key] = read_number(use, key, Spec(unit, -float("inf"), float("inf"), ""))
    return EffectUse(name, use.text("formula", ""), numbers)


def _sessions(table: Table, specs: Mapping[str, Spec]) -> dict[str, dict[str, Number]]:
    """Tables `[sessions.NAME]` of numbers of the plant."""
    own = {name: table.table(name).allow(*specs) for name in table}
    return {name: {key: read_number(part, key, specs[key]) for key in part} for name, part in own.items()}


def rig_table(rig: Rig) -> dict[str, Any]:
    """The rig as the tables of a rig file, each number in the unit it was written in."""
    return rig.table()


def _rig_table(rig: Rig) -> dict[str, Any]:
    sections: dict[str, dict[str, Any]] = {
        "supply": dict.fromkeys(schema.SUPPLY),
        "oil": dict.fromkeys(schema.OIL),
        "valve": dict.fromkeys(rig.valve_kind.schema(rig.corrector)),
        "jack": dict.fromkeys(rig.jack_kind.numbers),
        "load": dict.fromkeys(schema.LOAD),
    }
    filled: dict[str, dict[str, Any]] = {
        section: {name: number_entry(rig.numbers[name]) for name in names} for section, names in sections.items()
    }
    corrector = {"corrector": rig.corrector} if rig.valve_kind.correctors else {}
    filled["valve"] = {"kind": rig.valve, **corrector, **filled["valve"]}
    filled["jack"] = {"kind": rig.jack, **filled["jack"]}
    titles = {"name": rig.name, "title": rig.title, "source": rig.source, "recordings": rig.recordings}
    sensors = {name: sensor_entry(rig.signal(name), sensor) for name, sensor in rig.sensors.items()}
    effects = [
        {"name": use.name, "formula": use.formula, **{key: number_entry(number) for key, number in use.numbers.items()}}
        for use in rig.effects
    ]
    sessions = {name: {key: number_entry(number) for key, number in own.items()} for name, own in rig.sessions.items()}
    return {
        **{key: text for key, text in titles.items() if text},
        **({"effect_files": list(rig.effect_files)} if rig.effect_files else {}),
        **filled,
        "limits": {
            **{name: number_entry(number) for name, number in rig.limits.items()},
            **({"stop": rig.stop} if rig.stop != schema.STOPS[0] else {}),
        },
        "control": {number.name: number_entry(number) for number in rig.control},
        "sensors": sensors,
        **({"effects": effects} if effects else {}),
        **({"sessions": sessions} if sessions else {}),
    }


def save_rig(rig: Rig, path: Path) -> None:
    """Write a rig file; `load_rig` reads back the same rig."""
    path.write_text(rig_text(rig), encoding="utf-8")


def rig_text(rig: Rig) -> str:
    """The text of a rig file."""
    return toml_text(rig_table(rig))


def number_entry(number: Number) -> dict[str, Any]:
    def shown(value: float) -> float:
        return _shortest(value, number.unit, number.si)

    entry: dict[str, Any] = {"value": shown(number.value), "unit": number.unit}
    if number.source:
        entry["source"] = number.source
    if number.low is not None and number.high is not None:
        entry["bounds"] = [shown(number.low), shown(number.high)]
    if number.interval is not None:
        entry["interval"] = [shown(end) for end in number.interval]
    return entry


def _shortest(value: float, unit: str, si: str) -> float:
    """A value [SI] in a unit with 14 digits, or as few more as give it back to the last bit, where any do."""
    written = float(from_si(value, unit, si))
    texts = [float(f"{written:.{digits}g}") for digits in (14, 15, 16)]
    return next((text for text in texts if float(to_si(text, unit, si)) == value), written)


def sensor_entry(signal: Signal, sensor: Sensor) -> dict[str, Any]:
    """Noise and resolution in the unit that people are shown."""
    values = {key: _shortest(getattr(sensor, key), signal.unit, signal.si) for key in ("noise", "resolution")}
    return {key: {"value": value, "unit": signal.unit} for key, value in values.items()}
