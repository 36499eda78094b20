"""A rig as the tables of its file, each number in the unit it was written in."""

from typing import TYPE_CHECKING, Any

from . import schema
from .load import LOADS, SPECIMEN
from .number import number_entry
from .sensor import sensor_entry

if TYPE_CHECKING:
    from .rig import Rig


def rig_table(rig: "Rig") -> dict[str, Any]:
    further = {section: [name for name in specs if name in rig.numbers] for section, specs in schema.FURTHER.items()}
    sections: dict[str, dict[str, Any]] = {
        "supply": dict.fromkeys((*schema.SUPPLY, *further["supply"])),
        "oil": dict.fromkeys((*schema.OIL, *further["oil"])),
        "valve": dict.fromkeys(rig.valve_kind.schema(rig.corrector)),
        "jack": dict.fromkeys(rig.jack_kind.numbers),
        "load": dict.fromkeys((*schema.LOAD, *LOADS[rig.load])),
    }
    filled: dict[str, dict[str, Any]] = {
        section: {name: number_entry(rig.numbers[name]) for name in names} for section, names in sections.items()
    }
    corrector = {"corrector": rig.corrector} if rig.valve_kind.correctors else {}
    filled["valve"] = {"kind": rig.valve, **corrector, **filled["valve"]}
    filled["jack"] = {"kind": rig.jack, **filled["jack"]}
    if rig.load != SPECIMEN:
        filled["load"] = {"kind": rig.load, **filled["load"]}
    for section, part in (("inner", rig.inner), ("line_valve", rig.line_valve)):
        if part:
            own = {name: number_entry(rig.numbers[name]) for name in part.specs if name in rig.numbers}
            filled[section] = {**part.table(), **own}
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
        **({"shut_off": rig.shut_off.table()} if rig.shut_off else {}),
        **({"effects": effects} if effects else {}),
        **({"sessions": sessions} if sessions else {}),
    }
