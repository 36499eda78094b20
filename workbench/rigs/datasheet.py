"""Datasheets: what a maker says of a valve, a jack and a load, read from TOML; and a rig of it with the rest estimated.

A file has the tables `supply`, `oil`, `valve` with `[[valve.response]]` (and `[valve.rounding]`), `jack` and `load`;
every number is `{value, unit, source}`. What a maker does not say of the jack and its oil is a rule of thumb, which
says so in its source; the sensors are those that such a rig usually has.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import InputError, nearest
from ..base.toml import check_keys, read_toml
from ..base.units import to_si
from . import schema
from .jack import JACKS
from .rig import Number, Rig, Sensor, load_rig, number_specs
from .schema import Spec
from .valve import VALVES, ValveKind

KIND = "new-rig"
_RESPONSE = {
    "amplitude": Spec("1", 1e-3, 1.0, "amplitude of the sine, over full input"),
    "reference": Spec("Hz", 1e-3, 1e4, "frequency that the gain is referred to"),
    "f3db": Spec("Hz", 1e-2, 1e4, "where the gain has fallen by 3 dB"),
    "f90": Spec("Hz", 1e-2, 1e4, "where the phase is -90 deg"),
}
_NEEDED = ("Ps", "Aj", "AA", "AB", "S", "M")


@dataclass(frozen=True)
class Response:
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
    """A datasheet, SI: `valve` holds its scalar figures by name, `given` the rig's numbers that it states.

    `geometry` is the rig that a three-stage valve's published numbers are taken from, `rounding` how far each of them
    may move, half a unit of its last printed digit. `read` is the file as it was read.
    """

    name: str
    title: str
    source: str
    kind: str
    jack: str
    valve: Mapping[str, float]
    responses: tuple[Response, ...]
    given: Mapping[str, Number]
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
    """Read a datasheet. Raises InputError with file and key."""
    path = Path(path)
    table = read_toml(path)
    where = str(path)
    if table.get("experiment") != KIND:
        raise InputError(f'{where}: is no datasheet; write experiment = "{KIND}" on top')
    check_keys(table, ("experiment", "name", "title", "source", "supply", "oil", "valve", "jack", "load"), where)
    valve = _table(table, "valve", where)
    kind = VALVES[_word(valve, "kind", VALVES, f"{where}: [valve]")]
    jack = _word(_table(table, "jack", where), "kind", JACKS, f"{where}: [jack]")
    like = ("like", "rounding") if kind.needs_geometry else ()
    check_keys(valve, ("kind", "response", *like, *kind.figures), f"{where}: [valve]")
    figures = {key: _quantity(valve, key, spec, f"{where}: [valve]").value for key, spec in kind.figures.items()}
    geometry = _geometry(valve, kind, path) if kind.needs_geometry else None
    sheet = Datasheet(
        str(table.get("name", path.stem)),
        str(table.get("title", "")),
        str(table.get("source", "")),
        kind.name,
        jack,
        figures,
        tuple(_response(entry, kind, f"{where}: [[valve.response]]") for entry in valve.get("response", [])),
        _given(table, kind, jack, where),
        geometry,
        _rounding(valve.get("rounding", {}), geometry, f"{where}: [valve.rounding]"),
        table,
    )
    _check_responses(sheet, where)
    return sheet


def build_rig(sheet: Datasheet, valve: Mapping[str, Number], corrector: str = "p") -> Rig:
    """A rig of what the sheet gives, these numbers of the valve [SI], and rules of thumb for the rest.

    Raises InputError for a number that is not possible.
    """
    known = {name: number.value for name, number in (*sheet.given.items(), *valve.items())}
    areas = (known[sheet.areas[0]], known[sheet.areas[1]])
    specs = number_specs(sheet.kind, corrector, sheet.jack)
    numbers: dict[str, Number] = {}
    for name, spec in specs.items():
        if name in sheet.given or name in valve:
            numbers[name] = sheet.given.get(name) or valve[name]
        else:
            value, reason = _thumb(name, known, areas)
            known[name] = value
            spread = (value / 2, value * 2) if value else (None, None)
            numbers[name] = Number(name, value, spec.unit, spec.unit, f"estimate: {reason}", *spread)
    period = _declared("period", 1e-3, "s", "declared here: a usual control period")
    limits, sensors = _limits(known, areas), _sensors(known, areas[0])
    heads = (sheet.name, sheet.title, sheet.source, sheet.kind, corrector, sheet.jack)
    rig = Rig(*heads, numbers, limits, period, sensors)
    return rig.with_values(**{name: number.value for name, number in numbers.items()})


def main_lands(sheet: Datasheet, travel: float, eps: float) -> float:
    """K3 [m^2/s/Pa^0.5] that gives the rated flow at full travel [m]."""
    return sheet.valve["rated_flow"] / np.sqrt(sheet.valve["rated_drop"] / 2) / (travel + eps)


def _thumb(name: str, known: Mapping[str, float], areas: tuple[float, float]) -> tuple[float, str]:
    """A rule of thumb for a number of jack, oil or load, which may use those before it in the schema."""
    area, net = areas[0], known["Ps"] - known["Pr"]
    rules = {
        "beta": lambda: (1e9, "mineral oil with hoses and a little air"),
        "xmid": lambda: (0.0, "position counted from mid stroke"),
        "V0": lambda: (0.1 * area * known["S"], "a tenth of the swept volume"),
        "V0A": lambda: (0.1 * area * known["S"], "a tenth of the swept volume"),
        "V0B": lambda: (0.1 * areas[1] * known["S"], "a tenth of the swept volume"),
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
        "force": _declared("force", net * areas[0], "N", "stall force"),
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
    return {name: Sensor(noise=2e-4 * size, resolution=size / 2**16) for name, size in ranges.items()}


def _declared(name: str, value: float, unit: str, source: str) -> Number:
    return Number(name, float(value), unit, unit, source)


def _given(table: Mapping[str, Any], valve: ValveKind, jack: str, where: str) -> dict[str, Number]:
    """The numbers of supply, oil, jack and load that the sheet states."""
    tables = {"supply": schema.SUPPLY, "oil": schema.OIL, "jack": JACKS[jack].numbers, "load": schema.LOAD}
    found = {}
    for section, specs in tables.items():
        part = table.get(section, {}) if section == "oil" else _table(table, section, where)
        check_keys(part, (*specs, *(("kind",) if section == "jack" else ())), f"{where}: [{section}]")
        for name, spec in specs.items():
            if name in part or name in _NEEDED or (name == "Pr" and not valve.needs_geometry):
                found[name] = _quantity(part, name, spec, f"{where}: [{section}]")
    return found


def _geometry(valve: Mapping[str, Any], kind: ValveKind, path: Path) -> Rig:
    named = valve.get("like")
    if not isinstance(named, str):
        raise InputError(f'{path}: [valve]: like is missing; write like = "jack-10t", the rig with its printed numbers')
    rig = load_rig(named, path.parent)
    if rig.valve_kind is not kind:
        raise InputError(f"{path}: [valve]: like: rig {rig.name} has no {kind.name} valve")
    return rig


def _rounding(part: Mapping[str, Any], geometry: Rig | None, where: str) -> dict[str, float]:
    if geometry is None:
        return {}
    specs = geometry.valve_kind.numbers
    for name in part:
        if name not in specs:
            raise InputError(f'{where}: no number "{name}" of a valve; {nearest(name, specs)}')
    return {name: _quantity(part, name, Spec(specs[name].unit, 0, geometry[name], ""), where).value for name in part}


def _response(entry: Mapping[str, Any], kind: ValveKind, where: str) -> Response:
    check_keys(entry, ("stage", *_RESPONSE), where)
    stage = _word(entry, "stage", kind.stages, where)
    return Response(stage, **{key: _quantity(entry, key, spec, where).value for key, spec in _RESPONSE.items()})


def _check_responses(sheet: Datasheet, where: str) -> None:
    ids = [response.id for response in sheet.responses]
    for stage in sheet.valve_kind.stages:
        if not any(response.stage == stage for response in sheet.responses):
            raise InputError(f'{where}: add a [[valve.response]] with stage = "{stage}"')
    for response in sheet.responses:
        if ids.count(response.id) > 1:
            raise InputError(f"{where}: [[valve.response]]: {response.id} is there twice; leave one out")
        if response.reference >= min(response.f3db, response.f90):
            raise InputError(f"{where}: [[valve.response]] {response.id}: reference must be below f3db and f90")


def _table(table: Mapping[str, Any], name: str, where: str) -> Mapping[str, Any]:
    part = table.get(name)
    if not isinstance(part, Mapping):
        raise InputError(f"{where}: table [{name}] is missing; add it")
    return part


def _word(table: Mapping[str, Any], key: str, known: Any, where: str) -> str:
    word = table.get(key)
    if word not in known:
        raise InputError(f'{where}: {key} = "{word}": {nearest(str(word), known)}')
    return str(word)


def _quantity(part: Mapping[str, Any], name: str, spec: Spec, where: str) -> Number:
    """One `{value, unit, source}`; raises InputError when it is missing, of another kind or not possible."""
    entry = part.get(name)
    if entry is None:
        raise InputError(f"{where}: {name} is missing ({spec.meaning}, in {spec.unit})")
    if not isinstance(entry, Mapping) or not isinstance(entry.get("unit"), str):
        raise InputError(f'{where}: {name}: write {{value = ..., unit = "{spec.unit}"}}')
    check_keys(entry, ("value", "unit", "source"), f"{where}: {name}")
    value = entry.get("value")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where}: {name}: value must be a number")
    try:
        si = float(to_si(value, entry["unit"], spec.unit))
    except InputError as error:
        raise InputError(f"{where}: {name}: {error}") from None
    if not spec.low <= si <= spec.high:
        raise InputError(f"{where}: {name}: {si:g} {spec.unit} is not possible ({spec.low:g} to {spec.high:g})")
    return Number(name, si, entry["unit"], spec.unit, str(entry.get("source", "datasheet")))
