"""What a report is about, and its numbers: those of every controller and of the rig, and how other rigs differ."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields

from ...base.units import from_si
from ...control.controller_spec import ControllerSpec
from ...control.protocol import is_number
from ...report import Section, Table
from ...report.digits import four_digits
from ...rigs.number import Number
from ...rigs.rig import Rig

# the units that people write design numbers in, by the SI unit
_SHOWN = {"m": "mm", "m/s": "mm/s", "m/s^2": "mm/s^2", "s": "ms", "Pa": "bar", "1/Pa": "1/bar", "N/m": "kN/mm"}
_OF_THE_LOOP = {"stiffness": "N/m", "softest": "N/m", "stiffest": "N/m", "computing_delay": "s"}


@dataclass(frozen=True)
class Subject:
    """What a report is about: a rig, controllers, and further rigs by name."""

    rig: Rig
    controllers: Sequence[ControllerSpec] = ()
    rigs: Mapping[str, Rig] = field(default_factory=dict)


def numbers_section(subject: Subject) -> Section:
    """The numbers of controllers, of the rig, and of further rigs where they differ from it."""
    tables = []
    if lines := [line for spec in subject.controllers for line in _parts(spec)]:
        title = "Controllers, and the compensators around them"
        tables.append(Table(title, ["controller", "part", "design numbers"], lines))
    others = {name: rig for name, rig in subject.rigs.items() if _difference(rig, subject.rig)}
    if others:
        rows = [[name, _difference(rig, subject.rig)] for name, rig in others.items()]
        tables.append(Table(f"Rigs, against {subject.rig.name}", ["rig", "numbers that differ"], rows))
    whose = "controllers and rig" if lines else "the rig"
    return Section(f"Numbers of {whose}", [*tables, _rig(subject.rig)])


def _parts(spec: ControllerSpec) -> Iterator[list[str]]:
    """A line for the law and one for each compensator, from the inside out."""
    own = [f"{key} {_value(getattr(spec, key), unit)}" for key, unit in _OF_THE_LOOP.items() if getattr(spec, key)]
    plain = spec.plant is not None and spec.plant.signal("position").si != "m"  # "m" then stands for another unit
    for part, more in ((spec, own), *((compensator, []) for compensator in spec.compensators)):
        numbers = [
            f"{entry.name} {_value(getattr(part.design, entry.name), entry.metadata['unit'], plain)}"
            for entry in fields(part.design)
            if is_number(entry)
        ]
        yield [spec.name, part.use.rpartition(":")[2], ", ".join([*numbers, *more])]


def _value(value: float, si: str, plain: bool = False) -> str:
    """A design number in the unit that people write it in."""
    unit = si if plain else _SHOWN.get(si, si)
    return _with_unit(float(from_si(value, unit, si)), unit)


def _with_unit(value: float, unit: str) -> str:
    return four_digits(value) if unit == "1" else f"{four_digits(value)} {unit}"


def _difference(rig: Rig, nominal: Rig) -> str:
    """Numbers that are not the nominal rig's, with their factor."""
    changed = []
    for name, number in rig.numbers.items():
        before = nominal.numbers[name].value if name in nominal.numbers else None
        if number.value != before:
            factor = f" ({number.value / before:.3g} times)" if before else ""
            changed.append(f"{name} {_with_unit(number.shown, number.unit)}{factor}")
    return ", ".join(changed)


def _rig(rig: Rig) -> Table:
    entries = (*rig.numbers.values(), *rig.limits.values(), *rig.control)
    effects = [number for use in rig.effects for number in use.numbers.values()]
    rows = [_number(number, rig) for number in (*entries, *effects)]
    rows += [line for name in rig.sensors for line in _sensor(rig, name)]
    return Table(f"{rig.name}: {rig.title}", ["number", "value", "unit", "bounds", "meaning"], rows)


def _number(number: Number, rig: Rig) -> list[str]:
    ends = [float(from_si(end, number.unit, number.si)) for end in (number.low, number.high) if end is not None]
    meaning = rig.specs[number.name].meaning if number.name in rig.specs else ""
    return [number.name, four_digits(number.shown), number.unit, " to ".join(map(four_digits, ends)), meaning]


def _sensor(rig: Rig, name: str) -> Iterator[list[str]]:
    """Its noise and its resolution, in the unit in which the signal is shown."""
    signal, sensor = rig.signal(name), rig.sensors[name]
    scale = float(from_si(1.0, signal.unit, signal.si) - from_si(0.0, signal.unit, signal.si))
    for what, value in (("noise, standard deviation", sensor.noise), ("resolution", sensor.resolution)):
        yield [f"{name} sensor", four_digits(value * scale), signal.unit, "", what]
