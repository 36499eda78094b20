"""Rig files, read and written.

A rig file is TOML with the tables `supply`, `oil`, `valve` (`kind`, `corrector`), `jack` (`kind`), `load` (`kind`),
`inner` (`controls`), `line_valve` (`kind`, `side`), `limits`, `control`, `sensors.NAME`, `shut_off`, `effects` and
`sessions.NAME`; `effect_files` lists Python files beside it with a user's own effects. A number is `{value = 2.29,
unit = "mm", source = "...", bounds = [2.2, 2.4]}`; `bounds` (in the same unit) are how far a fit may move it,
`interval` within what a fit knows it (95 %). A session has numbers of the plant that were others in the records of a
campaign's session of that name. Everything is SI once read.
"""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

from ..base.errors import InputError, nearest
from ..base.table import ConfigTable
from ..base.toml import read_toml
from ..base.toml_text import toml_text
from ..base.units import Spec
from . import schema
from .inner_loop import read_inner_loop
from .jack import JACKS
from .line_valve import read_line_valve
from .load import LOADS, SPECIMEN
from .number import Number, read_number
from .rig import COMPUTING_DELAY, EffectUse, Rig, number_specs
from .sensor import read_sensors
from .shipped import bundled, bundled_platforms
from .shut_off import read_shut_off
from .together import check_speed_guard, problem_together
from .valve import VALVES

TITLES = ("name", "title", "source", "recordings", "effect_files")
NO_CORRECTOR = "p"  # of a valve whose kind has no spool loop to choose
TABLES = (
    *("supply", "oil", "valve", "jack", "load", "inner", "line_valve"),
    *("limits", "control", "sensors", "shut_off", "effects", "sessions"),
)


def load_rig(name: str | Path, beside: Path | None = None, corrector: str = "") -> Rig:
    """A rig from its file.

    Parameters
    ----------
    name
        A bundled rig's name, or the path of a rig file.
    beside
        Folder from which a relative path counts.
    corrector
        Another corrector of its valve than the file names.

    Returns
    -------
    The rig.

    Raises
    ------
    InputError
        With file and row.
    """
    if corrector:
        return load_rig(name, beside).with_corrector(corrector)
    return _read(*_located(name, beside))


def effect_files(name: str | Path) -> tuple[str, ...]:
    """The Python files with effects that a rig brings, by absolute path, of which nothing else is read or run."""
    path, shown = _located(name)
    return _effect_files(read_toml(path, shown), path)


def _effect_files(top: ConfigTable, path: Path) -> tuple[str, ...]:
    return tuple(str((path.parent / file).resolve()) for file in top.words("effect_files", "mine.py", ()))


def _located(name: str | Path, beside: Path | None = None) -> tuple[Path, str]:
    """The file of a rig, and what messages call it."""
    if str(name) in bundled():
        return Path(str(files("workbench") / "rigs" / f"{name}.toml")), str(name)
    path = (beside / name) if beside else Path(name)
    if path.suffix != ".toml":
        if str(name) in bundled_platforms():
            raise InputError(f'"{name}" is a platform on six jacks; jackbench run takes an experiment on it')
        hint = nearest(str(name), [*bundled(), *bundled_platforms()])
        end = "" if hint.endswith("?") else "."
        raise InputError(f'no bundled rig "{name}"; {hint}{end} A rig file ends in .toml')
    return path, str(path)


def _read(path: Path, shown: str) -> Rig:
    top = read_toml(path, shown)
    from .linear_file import FORMS, read_linear_rig

    if any(form in top for form in FORMS):
        return read_linear_rig(top, path.stem)
    top.allow(*TITLES, *TABLES)
    valve, jack = top.table("valve"), top.table("jack")
    valve_kind, jack_kind = VALVES[valve.word("kind", VALVES)], JACKS[jack.word("kind", JACKS)]
    corrector = valve.word("corrector", valve_kind.correctors) if valve_kind.correctors else NO_CORRECTOR
    load = top.table("load").word("kind", LOADS, SPECIMEN)
    numbers = {
        **_numbers(top.table("supply"), schema.SUPPLY | (schema.SHARED if valve_kind.has_lands else {})),
        **_numbers(top.table("oil"), schema.OIL | schema.GAS),
        **_numbers(valve, valve_kind.schema(corrector), "kind", "corrector"),
        **_numbers(jack, jack_kind.numbers, "kind"),
        **_numbers(top.table("load"), {**schema.LOAD, **LOADS[load]}, "kind"),
    }
    specs = number_specs(valve_kind.name, corrector, jack_kind.name, load) | schema.FURTHER_SPECS
    limits = _numbers(top.table("limits"), schema.LIMITS, "stop")
    inner = None
    if "inner" in top:
        table = top.table("inner")
        inner = read_inner_loop(table, limits["stroke"].value, limits["force"].value)
        specs |= inner.specs
        numbers |= _numbers(table, inner.specs, *inner.table())
    line_valve = None
    if "line_valve" in top:
        table = top.table("line_valve")
        line_valve = read_line_valve(table)
        specs |= line_valve.specs
        numbers |= _numbers(table, line_valve.specs, *line_valve.table())
    sensors = read_sensors(top.optional_table("sensors"))
    if wrong := problem_together(numbers, limits):
        table, name, problem = wrong
        raise top.table(table).complaint(name, problem)
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
        sessions=_sessions(top.optional_table("sessions"), specs),
        recordings=top.text("recordings", ""),
        effect_files=_effect_files(top, path),
        computing_delay=_computing_delay(control),
        stop=_stop(top.table("limits")),
        deadline=_deadline(control),
        load=load,
        inner=inner,
        line_valve=line_valve,
        shut_off=read_shut_off(top.optional_table("shut_off")),
    )


def _stop(limits: ConfigTable) -> str:
    if "stop" not in limits:
        return schema.STOPS[0]
    if limits.text("stop") == "depressurise":
        raise limits.complaint(
            "stop", f"write [shut_off] for a valve that does it; possible: {', '.join(schema.STOPS)}"
        )
    return limits.word("stop", schema.STOPS)


def _computing_delay(control: ConfigTable) -> Number:
    name = COMPUTING_DELAY.name
    return read_number(control, name, schema.CONTROL[name]) if name in control else COMPUTING_DELAY


def _deadline(control: ConfigTable) -> Number | None:
    return read_number(control, "deadline", schema.CONTROL["deadline"]) if "deadline" in control else None


def _numbers(table: ConfigTable, specs: Mapping[str, Spec], *words: str) -> dict[str, Number]:
    """All numbers of a table; a missing one that is not optional, an unknown or impossible one raises."""
    table.allow(*specs, *words)
    given = {name: spec for name, spec in specs.items() if name in table or name not in schema.OPTIONAL}
    return {name: read_number(table, name, spec) for name, spec in given.items()}


def _effect(use: ConfigTable) -> EffectUse:
    """One `[[effects]]` entry; which names and numbers exist is checked where effects are known."""
    name, numbers = use.text("name"), {}
    for key in use:
        if key not in ("name", "formula"):
            if not isinstance(use.values[key], Mapping):
                what = f"write {key} = {{value = ..., unit = ...}}, or leave it out; a text is only in name and formula"
                raise use.complaint(key, f"must be a number with its unit; {what}")
            unit = use.table(key).text("unit")
            numbers[key] = read_number(use, key, Spec(unit, -float("inf"), float("inf"), ""))
    return EffectUse(name, use.text("formula", ""), numbers)


def read_effects(path: str | Path) -> tuple[EffectUse, ...]:
    """The `[[effects]]` of a file that has nothing else. Raises InputError with file and row."""
    top = read_toml(Path(path)).allow("effects")
    return tuple(_effect(use) for use in top.tables("effects"))


def _sessions(table: ConfigTable, specs: Mapping[str, Spec]) -> dict[str, dict[str, Number]]:
    """Tables `[sessions.NAME]` of numbers of the plant."""
    own = {name: table.table(name).allow(*specs) for name in table}
    return {name: {key: read_number(part, key, specs[key]) for key in part} for name, part in own.items()}


def save_rig(rig: Rig, path: str | Path) -> None:
    """Write a rig file; `load_rig` reads back the same rig.

    Parameters
    ----------
    rig
        The rig.
    path
        The file.
    """
    Path(path).write_text(rig_text(rig), encoding="utf-8")


def rig_text(rig: Rig) -> str:
    """The text of a rig file."""
    return toml_text(rig.table())
