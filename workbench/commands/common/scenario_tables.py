"""The scenarios of an experiment: standard ones by name, and its own as tables [scenario.NAME]."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ...base.table import ConfigTable
from ...base.units import Spec
from ...loop.reach import check_flow, check_reach
from ...loop.scenarios import SCENARIOS, Scenario, scenario
from ...rigs.rig import Rig
from .profiles import SECONDS, read_profile

_KEYS = (
    *("signal", "size", "rate", "frequency", "file", "slow", "road", "start", "load", "load_at", "travel", "speed"),
    *("seconds", "profile", "acceleration", "jerk"),
)
SCENARIOS_KEYS = {
    "scenarios": "standard ones by name, or tables [scenario.NAME]",
    "scenario": "scenarios of the experiment's own, by name",
}
_COURSES = ("rate", "frequency", "file", "road", "profile")
_LARGE = 1e12


def read_scenarios(top: ConfigTable, rig: Rig) -> tuple[Scenario, ...]:
    """What `scenarios` lists: names of SCENARIOS, and of the experiment's own tables, whose references are planned on a
    rig. Raises InputError."""
    tables = top.optional_table("scenario")
    own = {name: _own(name, tables, rig) for name in tables}
    names = top.words("scenarios", "position-10mm")
    if unused := [name for name in own if name not in names]:
        raise tables.complaint(unused[0], "is not in the list `scenarios`; add it there or remove the table")
    where = str(top.place.inside("scenarios"))
    return tuple(own[name] if name in own else scenario(name, where) for name in names)


def check_scenarios(top: ConfigTable, scenarios: Iterable[Scenario], rigs: Iterable[Rig]) -> None:
    """Raises InputError for a scenario that is out of the reach of one of the rigs, and for a course of one's own that
    takes more flow than the weakest of them has."""
    every = list(rigs)
    for each in scenarios:
        for rig in every:
            top.about("scenarios", lambda each=each, rig=rig: check_reach(each, rig))
        top.about("scenarios", lambda each=each: check_flow(each, every))


def _own(name: str, tables: ConfigTable, rig: Rig) -> Scenario:
    table = tables.table(name, *_KEYS)
    table.named(name)
    if name in SCENARIOS:
        raise table.error("is a standard scenario; choose another name")
    signal = table.word("signal", ("position", "force"), "position")
    si = rig.signal(signal).si
    if len(courses := [key for key in _COURSES if key in table]) > 1:
        raise table.complaint(courses[1], f"not together with {courses[0]}; remove one")
    if not {"size", "file", "road", "load", "travel"} & set(table):
        raise table.error("asks for nothing; give a size, a file, a road, a load or a travel")
    load = _quantity(table, "load", "N", "force on the jack", -_LARGE)
    load_at = _quantity(table, "load_at", "s", "when the load comes") if "load_at" in table else 0.5
    if "load_at" in table and not load:
        raise table.complaint("load_at", "there is no load; give one")
    further: dict[str, Any] = {"load": load, "load_at": load_at, **_start(table), **_far_end(table)}
    _check_keys(table)
    if "file" in table:
        return _waveform(name, table, signal, further, rig)
    if "road" in table:
        return _road(name, table, signal, further, rig)
    size = _quantity(table, "size", si, "size", -_LARGE)
    if not size and (courses or not (load or "travel" in table)):
        raise table.complaint("size", "must be there, and not 0")
    if "profile" in table:
        if signal != "position":
            raise table.complaint("profile", "is for a position; a force has none")
        return read_profile(name, table, size, rig, further)
    if "rate" in table:
        further["rate"] = table.quantity("rate", Spec(f"{si}/s", 1e-12, _LARGE, "rate of a ramp"))
    if "frequency" in table:
        further["frequency"] = table.quantity("frequency", Spec("Hz", 1e-6, rig.nyquist, "frequency of a sine"))
    return Scenario(name, signal, size, table.quantity("seconds", SECONDS), **further)


def _road(name: str, table: ConfigTable, signal: str, further: dict[str, Any], rig: Rig) -> Scenario:
    """A random road over its `seconds`, from its first height on."""
    from ...records.road import CLASSES, road

    if signal != "position":
        raise table.complaint("road", "is a course of the position; remove one")
    if "size" in table:
        raise table.complaint("size", "the class of the road has the size; remove one")
    part = table.table("road", "class", "speed", "low", "high", "seed")
    duration = table.quantity("seconds", SECONDS)
    low, high = (part.quantity(key, Spec("Hz", 1e-3, rig.nyquist, f"{key}est frequency")) for key in ("low", "high"))
    speed = part.quantity("speed", Spec("m/s", 0.01, 100.0, "speed of the vehicle"))
    kind, seed = part.word("class", CLASSES), part.count("seed", 0)
    t, heights = table.about("road", lambda: road(kind, speed, duration, (low, high), seed))
    waveform = tuple(t.tolist()), tuple((heights - heights[0]).tolist())
    return Scenario(name, signal, float(np.ptp(heights)), duration, waveform=waveform, **further)


def _quantity(table: ConfigTable, key: str, si: str, meaning: str, low: float = 0.0) -> float:
    """A number of the table, 0 where it has none."""
    return table.quantity(key, Spec(si, low, _LARGE, meaning)) if key in table else 0.0


def _check_keys(table: ConfigTable) -> None:
    """Raises InputError for a key that another one must go with."""
    for key, needed in (("slow", "file"), ("acceleration", "profile"), ("jerk", "profile")):
        if key in table and needed not in table:
            raise table.complaint(key, f"needs a {needed}; give one")
    if "profile" in table and "travel" in table:
        raise table.complaint("travel", "not together with profile; remove one")


def _far_end(table: ConfigTable) -> dict[str, float]:
    """How far and how fast the specimen's far end moves, where it does."""
    if "profile" in table:
        return {}
    given = [key for key in ("travel", "speed") if key in table]
    if not given:
        return {}
    if len(given) == 1:
        raise table.complaint(given[0], "a far end moves by a travel at a speed; give both")
    return {
        "travel": table.quantity("travel", Spec("m", 1e-6, 100.0, "how far the specimen's far end moves")),
        "speed": table.quantity("speed", Spec("m/s", 1e-6, 100.0, "how fast the specimen's far end moves")),
    }


def _start(table: ConfigTable) -> dict[str, float]:
    """The start of the jack: a share of the stroke limit as a plain number, or a position from mid stroke."""
    value = table.values.get("start", 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return {"start": table.quantity("start", Spec("m", -100.0, 100.0, "position at the start, from mid stroke"))}
    if not -1 <= value <= 1:
        raise table.complaint("start", 'a plain number is a share of the stroke limit, -1 to 1; or write "50 mm"')
    return {"start_share": float(value)}


def _waveform(name: str, table: ConfigTable, signal: str, further: dict[str, Any], rig: Rig) -> Scenario:
    """The course of a file, from its first row on."""
    from ...loop.capability import capability
    from ...loop.reach import sampled_record, slowed_record
    from ...records.frequency_sheet import Columns

    if "size" in table:
        raise table.complaint("size", "the file has the size; remove one")
    slow = table.flag("slow", False)
    if slow and signal != "position":
        raise table.complaint("slow", "only a course of position is slowed; remove it")
    columns = table.about("file", lambda: Columns(Path(table.text("file"))))
    t, values = columns.times(), columns.values(signal, rig.signal(signal).si)
    period = rig.period.value
    record = slowed_record(t, values, period, capability(rig)) if slow else sampled_record(t, values, period)
    span, duration = float(np.ptp(record.values)), float(record.t[-1])
    if "seconds" in table:
        duration = table.quantity("seconds", SECONDS)
    slowed_for = rig.name if record.slowed != 1 else ""
    further |= {"slowed": record.slowed, "slowed_for": slowed_for, "left_out": record.left_out}
    return Scenario(
        name, signal, span, duration, waveform=(tuple(record.t.tolist()), tuple(record.values.tolist())), **further
    )
