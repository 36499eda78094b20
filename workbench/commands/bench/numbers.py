"""What was judged: the numbers of every controller and of the rig, and how the rigs of the sets differ from it."""

from collections.abc import Iterator
from dataclasses import fields

from ...base.units import from_si
from ...control.controller_spec import ControllerSpec
from ...report import Section, Table
from ...rigs.rig import Number, Rig
from ..common.bench_experiment import BenchConfig


def numbers_section(config: BenchConfig) -> Section:
    """Three tables."""
    controllers = [line for loop in config.loops for spec in loop.controllers for line in _parts(spec)]
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


def _parts(spec: ControllerSpec) -> Iterator[list[str]]:
    """A line for the law and one for each compensator, from the inside out: the numbers that are not at their default.

    SI.
    """
    of_the_loop = {"stiffness": "N/m", "softest": "N/m", "stiffest": "N/m", "computing_delay": "s"}
    own = [f"{key} {_with_unit(getattr(spec, key), unit)}" for key, unit in of_the_loop.items() if getattr(spec, key)]
    for part, more in ((spec, own), *((compensator, []) for compensator in spec.compensators)):
        entries = [entry for entry in fields(part.design) if getattr(part.design, entry.name) != entry.default]
        numbers = [
            f"{entry.name} {_with_unit(getattr(part.design, entry.name), entry.metadata['unit'])}" for entry in entries
        ]
        yield [spec.name, part.use.rpartition(":")[2], ", ".join([*numbers, *more])]


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
    entries = (*rig.numbers.values(), *rig.limits.values(), *rig.control)
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
