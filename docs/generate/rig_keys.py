"""The rig file, the datasheet and the table of all numbers, from what their readers allow."""

from collections.abc import Mapping

from workbench.base.signals import SIGNALS
from workbench.base.units import Spec
from workbench.rigs import schema
from workbench.rigs.datasheet_keys import RESPONSE, figures
from workbench.rigs.inner_loop import FORCE, POSITION, inner_specs
from workbench.rigs.jack import JACKS
from workbench.rigs.line_valve import CHECK, COUNTERBALANCE, LINE_VALVES, SIDES
from workbench.rigs.load import LOADS
from workbench.rigs.number import Number
from workbench.rigs.rig_file import bundled, load_rig
from workbench.rigs.tolerances import LENT, TOLERANCES
from workbench.rigs.valve import VALVES
from workbench.rigs.valve.lands import WIDTHS

from .markdown import code, number, page, plain, table

_HEADS = ("key", "unit", "least", "most", "meaning")
_RIG_FILE = """A rig is a TOML file. A number is a table of a value and its unit, any that converts to the SI unit
below; `source` says where it is from, `bounds` how far a fit may move it, `interval` within what a fit knows it
(95 %), both in the number's own unit. Ranges below are in SI. A key that is not
listed here is refused with the nearest one that is.

```toml
[oil]
beta = {value = 1.0, unit = "GPa", source = "datasheet", bounds = [0.85, 1.15]}
```

On top stand `name`, `title`, `source` and `recordings`, which are text, and `effect_files`, a list of Python files
beside the rig file. `[[effects]]` entries have a `name`, a `formula` and numbers, see [](effects.md).
`[sessions.NAME]` has numbers of the plant that were others in a session of a campaign. `jackbench show RIG --out
FILE.toml` writes a whole file to start from; the numbers of all tables in one list are in [](numbers.md)."""
_DATASHEET = """What `jackbench new-rig` must be given, by kind of valve and of jack; a file that leaves numbers out is
refused with the names of all that are missing, and `jackbench new DIR --ask two-stage` asks for them in turn. On top
stands `experiment = "new-rig"`. Further numbers of `[supply]`, `[oil]`, `[jack]` and `[load]` may be stated as in a
[rig file](rig_file.md); the others follow from rules of thumb, which the rig file names as their source. A number
without `bounds` gets those of its usual tolerance, and its source in the rig file says which. A three-stage
valve also names a rig with the printed numbers of such a valve, `valve.like`, and may say under `[valve.rounding]` how
far each of them may move."""
_TOLERANCE = """The bounds of a number as factors of its value, or as an amount beside it; a rule of thumb is wrong by
two either way at least. The rest of a lent geometry is within 0.9 to 1.1 times. Exact, as their sources say, are a
count, a rated current, a scale, where positions count from, and what a rig has none of."""
_NUMBERS = """Every number that the plant of a rig may have, by name, with the table of the rig file in which it stands,
its range in SI, and the values of the bundled rigs. `Rig.with_values(b=2000.0)` takes the same names, and so do
`[within]`, `[variation.NAME]` and the `numbers` of a session."""


def pages() -> dict[str, str]:
    """The pages of the rig file, of the datasheet and of the numbers."""
    return {"rig_file.md": _rig_file(), "datasheet.md": _datasheet(), "numbers.md": _numbers()}


def spec_table(specs: Mapping[str, Spec]) -> str:
    """One row a number: unit, range and meaning."""
    rows = [[code(name), *_range(spec), plain(spec.meaning)] for name, spec in specs.items()]
    return table(_HEADS, rows)


def _range(spec: Spec) -> list[str]:
    return [code(spec.unit), number(spec.low), number(spec.high)]


def _rig_file() -> str:
    valves = [
        part
        for kind in VALVES.values()
        for part in (
            f'### `[valve]` with `kind = "{kind.name}"`',
            spec_table(kind.numbers),
            *(
                f'With `corrector = "{corrector}"`:\n\n{spec_table(specs)}'
                for corrector, specs in kind.correctors.items()
                if specs
            ),
            _correctors(list(kind.correctors)),
        )
    ]
    jacks = [
        part
        for kind in JACKS.values()
        for part in (f'### `[jack]` with `kind = "{kind.name}"`', spec_table(kind.numbers))
    ]
    return page(
        "Rig file",
        _RIG_FILE,
        "## `[supply]`",
        spec_table(schema.SUPPLY | schema.SHARED),
        "## `[oil]`",
        spec_table(schema.OIL | schema.GAS),
        "## `[valve]`",
        *valves,
        "## `[jack]`",
        *jacks,
        "## `[load]`",
        spec_table(schema.LOAD),
        *(
            part
            for kind, specs in LOADS.items()
            if specs
            for part in (f'Further numbers with `kind = "{kind}"`:', spec_table(specs))
        ),
        "## `[inner]`",
        "The loop of a controller that is there already, where there is one, see [](../how/closed_loop.md). `controls` "
        f"is {_or((POSITION, FORCE))}, `full_command` the reference at command 1. These are of a loop of position; one "
        "of force has 1/N in the place of 1/m. Only the first number must be there:",
        spec_table(inner_specs(POSITION)),
        "## `[line_valve]`",
        "A valve in a line behind the servo-valve, where there is one, which lets oil into the chamber freely and out "
        f"only when it is opened, see [](../physics.md). `kind` is {_or(list(LINE_VALVES))}; `side` is the line, "
        f"{_or(list(SIDES))} with the same valve in each. The other line is its pilot. `pa` and `pb` are then measured "
        "in the chambers; the servo-valve sees `line_pa` and `line_pb`. All of these must be there. A datasheet's "
        "60 l/min at a drop of 4 bar, fully open, are 1.58e-6 m^3/s/Pa^0.5:",
        spec_table(LINE_VALVES[CHECK]),
        f'Further numbers with `kind = "{COUNTERBALANCE}"`:',
        spec_table({k: spec for k, spec in LINE_VALVES[COUNTERBALANCE].items() if k not in LINE_VALVES[CHECK]}),
        "## `[limits]`",
        spec_table(schema.LIMITS),
        f"`stop` says what the guard does after a trip: {_or(schema.STOPS)}; without it {code(schema.STOPS[0])}.",
        "## `[control]`",
        spec_table(schema.CONTROL),
        f"{_or_code(schema.OPTIONAL)} may be left out; every other number of these tables must be there.",
        "## `[sensors.NAME]`",
        "Each sensor has `noise`, the standard deviation of white noise, and `resolution`, its quantum, both in a unit "
        "of its signal and not negative. Where the load cell is, `kind` of `[load]` says. The names are those of the "
        "signals:",
        signals(),
    )


def _correctors(names: list[str]) -> str:
    return f"`corrector` chooses the spool loop: {_or(names)}." if names else ""


def _or(names: tuple[str, ...] | list[str]) -> str:
    return ", ".join(code(f'"{name}"') for name in names)


def _or_code(names: tuple[str, ...]) -> str:
    return f"{', '.join(map(code, names[:-1]))} and {code(names[-1])}"


def signals() -> str:
    """Names of the signals, which records, sensors and reports share."""
    rows = [[code(s.name), code(s.si), code(s.unit), plain(s.meaning)] for s in SIGNALS.values()]
    return table(("signal", "SI unit", "unit shown", "meaning"), rows)


def _datasheet() -> str:
    parts = []
    for valve in (kind for kind in VALVES.values() if kind.figures):
        wanted = [
            figure for figure in figures(valve, None) if figure.section in ("supply", "valve") and not figure.stage
        ]
        rows = [[code(f"{f.section}.{f.key}"), *_range(f.spec), plain(f.spec.meaning)] for f in wanted]
        parts += [f'## A valve with `kind = "{valve.name}"`', table(_HEADS, rows)]
        if valve.stages and any(figure.stage for figure in figures(valve, None)):
            stages = " and ".join(code(stage) for stage in valve.stages)
            parts += [f"Each of its stages, {stages}, has a `[[valve.response]]`:", spec_table(RESPONSE)]
        parts += ["It may say, too:", spec_table(WIDTHS)]
    for jack in JACKS.values():
        wanted = [figure for figure in figures(None, jack) if figure.section == "jack"]
        rows = [[code(f"jack.{f.key}"), *_range(f.spec), plain(f.spec.meaning)] for f in wanted]
        parts += [f'## A jack with `kind = "{jack.name}"`', table(_HEADS, rows)]
    rows = [
        [code(name), f"+-{t.beside:g}" if t.beside else f"{t.low:g} to {t.high:g}", t.why]
        for name, t in (TOLERANCES | LENT).items()
    ]
    usual = table(("number", "within", "because"), rows)
    return page("Datasheet", _DATASHEET, *parts, "## Usual tolerances", _TOLERANCE, usual)


def _numbers() -> str:
    """Every number of a plant by name, with the file's table that it is in; and the values of the bundled rigs."""
    places = sorted(_places().items(), key=lambda item: item[0].lower())
    rows = [[code(name), where, *_range(spec), plain(spec.meaning)] for name, (where, spec) in places]
    rigs = [rig for rig in map(load_rig, bundled()) if rig.is_jack]
    values = [[code(name), *(_shown(rig.numbers.get(name)) for rig in rigs)] for name, _ in places]
    return page(
        "All numbers of a rig",
        _NUMBERS,
        table(("name", "table", *_HEADS[1:]), rows),
        "## Values of the bundled rigs",
        table(("name", *(rig.name for rig in rigs)), values),
    )


def _shown(value: Number | None) -> str:
    return f"{value.shown:.6g} {plain(value.unit)}".removesuffix(" 1") if value else ""


def _places() -> dict[str, tuple[str, Spec]]:
    """Every number: the table of the rig file that it is in, and what is known of it."""
    tables = {"supply": schema.SUPPLY, "oil": schema.OIL, "load": schema.LOAD}
    tables |= {"inner": inner_specs(POSITION), "line_valve": LINE_VALVES[COUNTERBALANCE]}
    places = {name: (section, spec) for section, specs in tables.items() for name, spec in specs.items()}
    for kind in VALVES.values():
        for specs in (kind.numbers, *kind.correctors.values()):
            places |= {name: ("valve", spec) for name, spec in specs.items()}
    for section, kinds in (("jack", [jack.numbers for jack in JACKS.values()]), ("load", [*LOADS.values()])):
        places |= {name: (section, spec) for numbers in kinds for name, spec in numbers.items()}
    return places
