"""Datasheets: what a maker says of a valve, a jack and a load, read from TOML; and a rig of it with the rest estimated.

A file has the tables `supply`, `oil`, `valve` with `[[valve.response]]` (and `[valve.rounding]`), `jack` and `load`;
every number is `{value, unit, source, bounds}`. What a maker does not say of the jack and its oil is a rule of thumb,
which says so in its source; a number without bounds has those of its usual tolerance; the sensors are those that such a
rig usually has.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..base.signals import SIGNALS
from ..base.table import ConfigTable
from ..base.toml import read_toml
from ..base.units import Spec, from_si, to_si, usual_unit
from . import schema
from .datasheet_keys import RESPONSE, check_complete, figures
from .datasheet_rules import RULES, check_together
from .jack import JACKS
from .number import Number, read_number
from .rig import Rig, number_specs
from .rig_file import load_rig
from .sensor import Sensor
from .tolerances import EXACT, with_tolerance
from .valve import VALVES, ValveKind
from .valve.lands import WIDTHS

KIND = "new-rig"
HOSE = Spec("m^3", 0.0, 0.5, "volume of the hose or pipe from the valve to a chamber")
_DIGITS = 3  # of a rule of thumb


@dataclass(frozen=True)
class DatasheetResponse:
    """Corner frequencies [Hz] of a stage at an amplitude (part of full input), gain referred to `reference` [Hz]."""

    stage: str
    amplitude: float
    reference: float
    f3db: float
    f90: float

    @property
    def id(self) -> str:
        """Such as "pilot_100"."""
        return f"{self.stage}_{100 * self.amplitude:g}"


@dataclass(frozen=True)
class Datasheet:
    """A datasheet, SI: `valve` holds its scalar figures by name, `ranges` between what those lie that it states so, and
    `given` the rig's numbers that it states, `hose` the volume [m^3] of the one to each chamber.

    `geometry` is the rig that a three-stage valve's published numbers are taken from, `rounding` how far each of them
    may move, half a unit of its last printed digit. `read` is the file as it was read.
    """

    name: str
    title: str
    source: str
    kind: str
    jack: str
    valve: Mapping[str, float]
    ranges: Mapping[str, tuple[float, float]]
    responses: tuple[DatasheetResponse, ...]
    given: Mapping[str, Number]
    hose: float
    geometry: Rig | None
    rounding: Mapping[str, float]
    read: Mapping[str, Any]

    @property
    def valve_kind(self) -> ValveKind:
        """What is known of this kind of valve."""
        return VALVES[self.kind]

    @property
    def areas(self) -> tuple[str, str]:
        """Names of the piston areas of side A and side B."""
        return JACKS[self.jack].areas


def load_datasheet(path: str | Path) -> Datasheet:
    """Read a datasheet. Raises InputError with file and key, or with the names of all numbers that are missing."""
    path = Path(path)
    return read_datasheet(read_toml(path), path.parent, path.stem)


def read_datasheet(top: ConfigTable, folder: Path, name: str) -> Datasheet:
    """A datasheet of a document, as `load_datasheet`; `name` is that of one that says none."""
    if top.values.get("experiment") != KIND:
        raise top.complaint("experiment", f'is no datasheet; write experiment = "{KIND}" on top')
    top.allow("experiment", "name", "title", "source", "supply", "oil", "valve", "jack", "load")
    check_complete(top)
    valve = top.table("valve")
    kind = VALVES[valve.word("kind", [name for name, known in VALVES.items() if known.figures])]
    jack = top.table("jack").word("kind", JACKS)
    like = ("like", "rounding") if kind.needs_geometry else ()
    stated = {**kind.figures, **{key: spec for key, spec in WIDTHS.items() if key in valve}}
    valve.allow("kind", "response", *like, *kind.figures, *WIDTHS)
    geometry = _geometry(valve, kind, folder) if like else None
    sheet = Datasheet(
        top.text("name", name),
        top.text("title", ""),
        top.text("source", ""),
        kind.name,
        jack,
        {key: valve.quantity(key, spec, "source", "bounds") for key, spec in stated.items()},
        _ranges(valve, stated),
        _responses(valve, kind),
        _given(top, kind, jack),
        top.table("jack").quantity("hose", HOSE, "source", "bounds") if "hose" in top.table("jack") else 0.0,
        geometry,
        _rounding(valve.optional_table("rounding"), geometry) if geometry else {},
        top.values,
    )
    given = {name: number.value for name, number in sheet.given.items()}
    try:
        check_together(RULES, {**sheet.valve, **given, "hose": sheet.hose})
    except InputError as error:
        raise top.error(str(error)) from None
    return sheet


def build_rig(sheet: Datasheet, valve: Mapping[str, Number], corrector: str = "p") -> Rig:
    """A rig of what the sheet gives, these numbers of the valve [SI], and rules of thumb for the rest.

    Raises InputError for a number that is not possible.
    """
    known = {name: number.value for name, number in (*sheet.given.items(), *valve.items())} | {"hose": sheet.hose}
    areas = (known[sheet.areas[0]], known[sheet.areas[1]])
    specs = number_specs(sheet.kind, corrector, sheet.jack)
    numbers: dict[str, Number] = {}
    for name, spec in specs.items():
        if name in sheet.given or name in valve:
            numbers[name] = with_tolerance(sheet.given.get(name) or valve[name], spec)
        else:
            value, reason = _thumb(name, known, areas)
            estimate = _declared(
                name, value, spec.unit, f"{'declared here' if name in EXACT else 'estimate'}: {reason}"
            )
            known[name] = estimate.value
            numbers[name] = with_tolerance(estimate, spec, factor=2)
    period = _declared("period", 1e-3, "s", "declared here: a usual control period")
    numbers |= {name: sheet.given[name] for name in schema.GAS if name in sheet.given}
    limits, sensors = _limits(known, areas), _sensors(known, areas[0])
    heads = (sheet.name, sheet.title, sheet.source, sheet.kind, corrector, sheet.jack)
    rig = Rig(*heads, numbers, limits, period, sensors)
    return rig.with_values(**{name: number.value for name, number in numbers.items()})


def main_lands(sheet: Datasheet, travel: float, eps: float) -> float:
    """K3 [m^2/s/Pa^0.5] that gives the rated flow at full travel [m]."""
    return sheet.valve["rated_flow"] / np.sqrt(sheet.valve["rated_drop"] / 2) / (travel + eps)


def _thumb(name: str, known: Mapping[str, float], areas: tuple[float, float]) -> tuple[float, str]:
    """A rule of thumb for a number of jack, oil or load, which may use those before it in the schema."""
    area, net, hose = areas[0], known["Ps"] - known["Pr"], known["hose"]
    dead = "a tenth of the swept volume" + (f", and {1e3 * hose:.3g} l of hose" if hose else "")
    rules = {
        "beta": lambda: (1e9, "mineral oil with hoses and a little air"),
        "xmid": lambda: (0.0, "position counted from mid stroke"),
        "V0": lambda: (0.1 * area * known["S"] + hose, dead),
        "V0A": lambda: (0.1 * area * known["S"] + hose, dead),
        "V0B": lambda: (0.1 * areas[1] * known["S"] + hose, dead),
        "Cl": lambda: (2e-3 * _lands(known) / np.sqrt(2 * net), "0.2 % of full flow at full pressure"),
        "ke": lambda: (1e3 * net * area / known["S"], "the stall force gives it 0.1 % of the stroke"),
        "ce": lambda: (np.sqrt(known["ke"] * known["M"]), "half of critical with the moving mass"),
        "b": lambda: (0.03 * net * area / _fastest(known, areas), "3 % of the stall force at no-load speed"),
        "ks": lambda: (0.0, "no specimen"),
        "cs": lambda: (0.0, "no specimen"),
    }
    value, reason = rules[name]()
    return float(value), reason


def _lands(known: Mapping[str, float]) -> float:
    """Flow over root of pressure drop [m^3/s/Pa^0.5] of one land of all valves at full command."""
    return known["n"] * known["K3"] * (known["z3max"] + known["eps"])


def _fastest(known: Mapping[str, float], areas: tuple[float, float]) -> float:
    """No-load speed [m/s] at full command: v^2 = k^2 (A Ps - B Pr)/(A^3 + B^3) with the areas A, B."""
    driving, driven = areas
    force = driving * known["Ps"] - driven * known["Pr"]
    return _lands(known) * float(np.sqrt(force / (driving**3 + driven**3)))


def _limits(known: Mapping[str, float], areas: tuple[float, float]) -> dict[str, Number]:
    net = known["Ps"] - known["Pr"]
    return {
        "stroke": _declared("stroke", 0.48 * known["S"], "m", "declared here: short of the end stops"),
        "speed": _declared("speed", 1.1 * _fastest(known, areas), "m/s", "declared here: 1.1 times the no-load speed"),
        "force": _declared("force", net * areas[0], "N", "declared here: stall force"),
        "command_rate": _declared("command_rate", 200.0, "1/s", "declared here: full reversal in 10 ms"),
    }


def _sensors(known: Mapping[str, float], area: float) -> dict[str, Sensor]:
    """What such a rig usually measures: 16 bits over the range, noise of 0.02 % of it."""
    force = area * known["Ps"]
    ranges = {
        "spool": 3 * known["z3max"],
        "position": known["S"],
        "force": 2 * force,
        "acceleration": 2 * force / known["M"],
    }
    ranges |= dict.fromkeys(("pa", "pb", "supply"), 2 * known["Ps"])
    if "imax" in known:
        ranges["current"] = 4 * known["imax"]
    sources = {"noise": "assumed: 0.02 % of the range", "resolution": "assumed: 16 bits over the range"}
    return {
        name: Sensor(_rounded(2e-4 * size, name), _rounded(size / 2**16, name), sources)
        for name, size in ranges.items()
    }


def _declared(name: str, value: float, unit: str, source: str) -> Number:
    """A number with the digits that a rule of thumb has, in the unit that people use."""
    shown = usual_unit(value, unit)
    return Number(name, _in_digits(value, shown, unit), shown, unit, source)


def _rounded(value: float, signal: str) -> float:
    """A sensor's number [SI]."""
    return _in_digits(value, SIGNALS[signal].unit, SIGNALS[signal].si)


def _in_digits(value: float, unit: str, si: str) -> float:
    """A value [SI], rounded in the unit that it is shown in."""
    return float(to_si(float(f"{from_si(value, unit, si):.{_DIGITS}g}"), unit, si))


def _given(top: ConfigTable, kind: ValveKind, jack: str) -> dict[str, Number]:
    """The numbers of supply, oil, jack and load that the sheet states."""
    specs = {"supply": schema.SUPPLY, "oil": schema.OIL | schema.GAS, "jack": JACKS[jack].numbers, "load": schema.LOAD}
    needed = {figure.key for figure in figures(kind, JACKS[jack])}
    given = {}
    for section, numbers in specs.items():
        part = top.optional_table(section) if section == "oil" else top.table(section)
        part.allow(*numbers, *(("kind", "hose") if section == "jack" else ()))
        for name, spec in numbers.items():
            if name in part or name in needed:
                given[name] = read_number(part, name, spec, "datasheet")
    return given


def _ranges(valve: ConfigTable, specs: Mapping[str, Spec]) -> dict[str, tuple[float, float]]:
    """The bounds [SI] of the valve's figures that have some."""
    bounded = [key for key in specs if isinstance(entry := valve.values[key], Mapping) and "bounds" in entry]
    numbers = [read_number(valve, key, specs[key]) for key in bounded]
    return {n.name: (n.low, n.high) for n in numbers if n.low is not None and n.high is not None}


def _geometry(valve: ConfigTable, kind: ValveKind, folder: Path) -> Rig:
    rig = load_rig(valve.text("like"), folder)
    if rig.valve_kind is not kind:
        raise valve.complaint("like", f"rig {rig.name} has no {kind.name} valve; name the rig with its printed numbers")
    return rig


def _rounding(part: ConfigTable, geometry: Rig) -> dict[str, float]:
    specs = geometry.valve_kind.numbers
    part.allow(*specs)
    return {name: part.quantity(name, Spec(specs[name].unit, 0, geometry[name], ""), "source") for name in part}


def _responses(valve: ConfigTable, kind: ValveKind) -> tuple[DatasheetResponse, ...]:
    entries = valve.tables("response", "stage", *RESPONSE)
    responses = [_response(entry, kind) for entry in entries]
    for i, response in enumerate(responses):
        if response.id in [other.id for other in responses[:i]]:
            raise entries[i].error(f"{response.id} is there twice; leave one out")
    return tuple(responses)


def _response(entry: ConfigTable, kind: ValveKind) -> DatasheetResponse:
    numbers = {key: entry.quantity(key, spec, "source") for key, spec in RESPONSE.items()}
    entry.about("reference", lambda: check_together(RULES, numbers))
    return DatasheetResponse(entry.word("stage", kind.stages), **numbers)
