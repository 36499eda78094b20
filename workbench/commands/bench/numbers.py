"""What was judged: the numbers of every controller and of the rig, and how the rigs of the sets differ from it."""

from collections.abc import Iterator, Mapping
from typing import Any

from ...base.units import from_si
from ...report import Section, Table
from ...report.table import shown
from ...rigs.rig import Number, Rig
from ..common.bench_experiment import BenchConfig

_NO_NUMBERS = ("use", "compensators")


def numbers_section(config: BenchConfig) -> Section:
    """Three tables."""
    controllers = [line for name, table in config.source["controllers"].items() for line in _parts(name, table)]
    rigs = [
        [loop.signal.name, name, _difference(rig, loop.rig)] for loop in config.loops for name, rig in loop.rigs.items()
    ]
    return Section(
        "Numbers of controllers and rigs",
        [
            Table("Controllers, and the compensators around them", ["controller", "part", "numbers"], controllers),
            Table(f"Rigs, against {config.rig.name}", ["loops", "rig", "numbers that differ"], rigs),
            _rig(config.rig),
        ],
    )


def _parts(name: str, table: Mapping[str, Any]) -> Iterator[list[str]]:
    """A line for the law and one for each compensator, from the inside out."""
    for part in (table, *table.get("compensators", ())):
        numbers = ", ".join(f"{key} {_written(entry)}" for key, entry in part.items() if key not in _NO_NUMBERS)
        yield [name, part["use"].rpartition(":")[2], numbers]


def _written(entry: Any) -> str:
    """A number as the file has it: `{value, unit}` or text."""
    if not isinstance(entry, Mapping):
        return shown(entry)
    return _with_unit(entry["value"], entry.get("unit", "1"))


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.5g}" if unit == "1" else f"{value:.5g} {unit}"


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
    entries = (*rig.numbers.values(), *rig.limits.values(), rig.period, rig.computing_delay)
    effects = [number for use in rig.effects for number in use.numbers.values()]
    sensors = [
        [f"{name}: noise, resolution [SI]", f"{sensor.noise:g}, {sensor.resolution:g}", "", "", ""]
        for name, sensor in rig.sensors.items()
    ]
    rows = [_number(number, rig) for number in (*entries, *effects)]
    return Table(f"{rig.name}: {rig.title}", ["number", "value", "unit", "bounds", "meaning"], rows + sensors)


def _number(number: Number, rig: Rig) -> list[str]:
    ends = [float(from_si(end, number.unit, number.si)) for end in (number.low, number.high) if end is not None]
    meaning = rig.specs[number.name].meaning if number.name in rig.specs else ""
    return [number.name, f"{number.shown:.5g}", number.unit, " to ".join(f"{end:.5g}" for end in ends), meaning]
