"""Files of platforms.

A file has the tables [payload], [place], [joints], [legs] and six times [[leg]]. [legs] has the jack rig of all legs,
`rig`, their numbers, and under [legs.jack] numbers of that rig that are others here; a [[leg]] has the points `base`
and `joint`, written `{at = [x, y, z], unit = "m", source = "..."}`, and where it differs from the others its own
`rig`, numbers and table `jack`. [[effects]] are what joints and payload show, as `effects.py` lists them.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from ...base.errors import InputError, nearest
from ...base.table import ConfigTable
from ...base.toml import read_toml
from ...base.toml_text import toml_text
from ...base.units import Spec, to_si
from ..number import Number, number_entry, read_number
from ..rig import Rig
from ..rig_file import load_rig, rig_text
from ..shipped import bundled_platforms
from .effects import effect_tables, read_platform_effects
from .platform import COORDINATE, JOINTS, LEG, LEGS, PAYLOAD, PLACE, Leg, Platform, Point

TABLES = ("payload", "place", "joints", "legs", "leg", "effects")


def platform_path(name: str) -> Path:
    """The file of a bundled platform."""
    return Path(str(files("workbench") / "rigs" / "platform" / f"{name}.toml"))


def is_platform(name: str | Path) -> bool:
    """Whether that is a platform: a bundled one's name, or a file with the legs of one."""
    path = Path(name)
    return str(name) in bundled_platforms() or (path.suffix == ".toml" and path.is_file() and "legs" in read_toml(path))


def load_rig_or_platform(name: str) -> Rig | Platform:
    """A bundled rig or platform by name, or the file of one. Raises InputError."""
    return load_platform(name) if is_platform(name) else load_rig(name)


def load_platform(name: str | Path, beside: Path | None = None) -> Platform:
    """A bundled platform by name, or a file by path (relative to `beside`). Raises InputError with file and row."""
    if str(name) in bundled_platforms():
        return _read(platform_path(str(name)), str(name))
    path = (beside / name) if beside else Path(name)
    if path.suffix != ".toml":
        hint = nearest(str(name), bundled_platforms())
        end = "" if hint.endswith("?") else "."
        raise InputError(f'no bundled platform "{name}"; {hint}{end} A platform file ends in .toml')
    return _read(path, str(path))


def _read(path: Path, shown: str) -> Platform:
    top = read_toml(path, shown)
    top.allow("name", "title", "source", *TABLES)
    numbers = {**_numbers(top, "payload", PAYLOAD), **_numbers(top, "place", PLACE), **_numbers(top, "joints", JOINTS)}
    shared = top.table("legs").allow("rig", "jack", *LEG)
    entries = top.tables("leg", "rig", "jack", "base", "joint", *LEG)
    if len(entries) != LEGS:
        raise top.error(f"has {len(entries)} tables [[leg]]; a platform has {LEGS}")
    load = cache(lambda name: load_rig(name, path.parent))
    common = _rig(shared, load)
    legs = tuple(_leg(shared, entry, common, load) for entry in entries)
    if len({leg.rig.period.value for leg in legs}) > 1:
        raise top.error("the jacks of the legs have different control periods; give them one")
    name = top.named(top.text("name", path.stem))
    effects = read_platform_effects(top.tables("effects"), LEGS)
    return Platform(name, top.text("title", ""), top.text("source", ""), numbers, legs, effects)


def _numbers(top: ConfigTable, name: str, specs: Mapping[str, Spec]) -> dict[str, Number]:
    table = top.table(name, *specs)
    return {key: read_number(table, key, spec) for key, spec in specs.items()}


def _rig(table: ConfigTable, load: Callable[[str], Rig]) -> Rig:
    """The jack of a table of legs."""
    rig = table.about("rig", lambda: load(table.text("rig")))
    if not rig.is_jack:
        raise table.complaint("rig", f"{rig.name} is a linear plant; a leg needs a jack")
    return _with_own(rig, table.optional_table("jack"))


def _leg(shared: ConfigTable, own: ConfigTable, common: Rig, load: Callable[[str], Rig]) -> Leg:
    numbers = {key: read_number(own if key in own else shared, key, spec) for key, spec in LEG.items()}
    rig = _rig(own, load) if "rig" in own else _with_own(common, own.optional_table("jack"))
    (base, base_source), (joint, joint_source) = (_point(own, end) for end in ("base", "joint"))
    return Leg(rig, base, joint, numbers, (base_source, joint_source))


def _with_own(rig: Rig, table: ConfigTable) -> Rig:
    values = {key: read_number(table, key, rig.specs[key]).value for key in table.allow(*rig.specs)}
    return table.about("", lambda: rig.with_values(**values)) if values else rig


def _point(leg: ConfigTable, key: str) -> tuple[Point, str]:
    entry = leg.table(key, "at", "unit", "source")
    at = entry.numbers("at", "[1.0, 0.0, 0.0]")
    if len(at) != 3:
        raise entry.complaint("at", "must be three coordinates, [x, y, z]")
    unit = entry.text("unit")
    x, y, z = (entry.about("unit", lambda value=value: float(to_si(value, unit, "m"))) for value in at)
    for value in (x, y, z):
        if problem := COORDINATE.problem(value):
            raise entry.complaint("at", problem)
    return (x, y, z), entry.text("source", "")


def platform_files(platform: Platform) -> dict[str, str]:
    """The texts of platform.toml and of the rigs of its legs, by file name."""
    legs = {f"leg{i}.toml": rig_text(leg.rig) for i, leg in enumerate(platform.legs, 1)}
    return {**legs, "platform.toml": platform_text(platform, list(legs))}


def platform_text(platform: Platform, rigs: Sequence[str]) -> str:
    """The text of a platform file whose legs have rig files [6], by path from it; `load_platform` reads back the same
    platform."""
    parts = {"payload": PAYLOAD, "place": PLACE, "joints": JOINTS}
    tables = {part: {key: number_entry(platform.numbers[key]) for key in specs} for part, specs in parts.items()}
    legs = [_leg_table(leg, rig) for leg, rig in zip(platform.legs, rigs, strict=True)]
    head = {"name": platform.name, "title": platform.title, "source": platform.source}
    return toml_text({**head, **tables, "legs": {"rig": rigs[0]}, "leg": legs, **effect_tables(platform.effects)})


def _leg_table(leg: Leg, rig: str) -> dict[str, Any]:
    points = {"base": (leg.base, leg.sources[0]), "joint": (leg.joint, leg.sources[1])}
    ends = {end: {"at": list(at), "unit": "m", "source": source} for end, (at, source) in points.items()}
    return {"rig": rig, **ends} | {name: number_entry(number) for name, number in leg.numbers.items()}
