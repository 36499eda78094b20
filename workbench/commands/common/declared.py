"""Experiments declared once: each field of a dataclass has its unit, bounds, default and meaning.

    @declared
    class SinesConfig(Experiment):
        KIND = "sines"
        rig: Rig = part(jack, {"rig": "a jack"})
        share: float | None = fraction("of what the weakest rig's valve gives", default=None)

`SinesConfig.load` reads a file of it, `SinesConfig(...)` checks what Python gives, and `takes_experiment` makes the
command of it.
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar, dataclass_transform

from ...base.errors import InputError, echo, nearest
from ...base.table import ConfigTable
from ...base.units import Spec, quantity as quantity_of
from ...rigs.rig import Rig
from .. import COMMANDS
from .experiment_file import controller_tables, data_files, read_experiment
from .options import Study, bounded, computes, finish, jobs, works
from .shipped import experiment

T = TypeVar("T")
E = TypeVar("E", bound="Experiment")
MANY = 10**18 - 1  # a bound that is none
OF_RUN = ("step", "paper", "corrector", "platform", "automatic")  # the kinds that `jackbench run` takes


@dataclass(frozen=True)
class Key:
    """How a field is read: its `meanings` by the keys of the file that it takes, and what makes its value of a
    ExperimentFile and its name; `check` makes it of what Python gives. `asked`: whether an option replaces it. `of`:
    the method of a ConfigTable that reads its one key, and what is asked of that."""

    meanings: Mapping[str, str]
    read: Callable[["ExperimentFile", str], Any]
    check: Callable[[Any], Any] | None = None
    asked: bool = False
    of: tuple[str, Mapping[str, Any]] | None = None


def part(read: Callable[["ExperimentFile"], T], meanings: Mapping[str, str], **default: Any) -> Any:
    """What a function makes of the `meanings`' keys, and of fields that are read before."""
    return field(metadata={"key": Key(meanings, lambda at, _: read(at))}, kw_only=True, **default)


def quantity(unit: str, low: float, high: float, meaning: str, *, default: Any = MISSING) -> Any:
    """A number with a unit, within bounds [SI]."""
    spec = Spec(unit, low, high, meaning)

    def check(value: float | str) -> float:
        number = quantity_of(value, unit)
        if problem := spec.problem(number):
            raise InputError(problem)
        return number

    return _one(meaning, lambda at, key: at.top.quantity(key, spec), check, default, ("quantity", {"spec": spec}))


def count(low: int, high: int, meaning: str, *, default: Any = MISSING, asked: bool = False) -> Any:
    """A whole number within bounds; where it is `asked`, the command has an option of its name."""

    def check(value: int) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise InputError(f"is {value!r}; give a whole number, {low} to {high}")
        return value

    def read(at: "ExperimentFile", key: str) -> int:
        return at.asked.get(key) or at.top.count(key, low, high)

    return _one(meaning, read, check, default, ("count", {"least": low, "most": high}), asked)


def fraction(meaning: str, *, default: Any = MISSING) -> Any:
    """A number above 0, at most 1; its `meaning` begins with the noun that it is a share of."""

    def check(value: float) -> float:
        if not 0 < value <= 1:
            raise InputError(f"a share {meaning}, at most 1")
        return value

    def read(at: "ExperimentFile", key: str) -> float:
        return at.top.about(key, lambda: check(at.top.positive(key)))

    return _one(f"share, at most 1, {meaning}", read, check, default, ("positive", {"unit": ""}))


def _one(
    meaning: str,
    read: Callable[["ExperimentFile", str], Any],
    check: Callable[[Any], Any],
    default: Any,
    of: tuple[str, Mapping[str, Any]],
    asked: bool = False,
) -> Any:
    """A field of one key, which has the field's name; where the file has none, it is the default, if there is one."""

    def given(at: "ExperimentFile", name: str) -> Any:
        there = default is MISSING or name in at.top or at.asked.get(name) is not None
        return read(at, name) if there else default

    key = Key({"": meaning}, given, check, asked, of)
    return field(default=default, metadata={"key": key}, kw_only=True)


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(part, quantity, count, fraction))
def declared(kind: type[T]) -> type[T]:
    """Make a class of such fields a frozen dataclass."""
    return dataclass(frozen=True, kw_only=True)(kind)


class ExperimentFile:
    """An experiment while it is read: its table `top`, its file's `path`, what was `asked` in place of its keys.

    Each field of its `kind` is an attribute, read when it is first wanted; `known` has those that are.
    """

    def __init__(
        self,
        kind: type["Experiment"],
        top: ConfigTable,
        path: Path,
        asked: Mapping[str, Any],
        known: Mapping[str, Any] | None = None,
    ) -> None:
        self.kind, self.top, self.path, self.asked = kind, top, path, asked
        self.known = dict(known or {})

    @cached_property
    def tables(self) -> dict[str, ConfigTable]:
        """The tables of its controllers, by name."""
        return controller_tables(self.top, self.path.parent)

    def __getattr__(self, name: str) -> Any:
        key = keys_of(self.kind).get(name) if not name.startswith("_") else None
        if key is None:
            raise AttributeError(name)
        if name not in self.known:
            self.known[name] = key.read(self, name)
        return self.known[name]


def keys_of(kind: type["Experiment"]) -> dict[str, Key]:
    """How each field is read, by its name."""
    return {entry.name: entry.metadata["key"] for entry in fields(kind) if "key" in entry.metadata}


def meanings(kind: type["Experiment"]) -> dict[str, str]:
    """What every key of a file means."""
    found = {key or name: text for name, entry in keys_of(kind).items() for key, text in entry.meanings.items()}
    return {"experiment": "the kind", **found}


def _source(at: ExperimentFile) -> dict[str, Any]:
    values = {key: value for key, value in at.top.values.items() if key != "from"}
    return {**values, "controllers": {name: table.values for name, table in at.tables.items()}} if at.tables else values


@declared
class Experiment:
    """An experiment of a KIND; `source` is its file as it was read, with the tables of all its controllers."""

    KIND: ClassVar[str]
    source: Mapping[str, Any] = part(_source, {}, default_factory=dict)

    def __post_init__(self) -> None:
        for entry in fields(self):
            name, key, value = entry.name, entry.metadata.get("key"), getattr(self, entry.name)
            if key is None or key.check is None or value == entry.default:
                continue
            try:
                object.__setattr__(self, name, key.check(value))
            except InputError as error:
                raise InputError(f"{self.KIND}: {name}: {error}") from None

    @classmethod
    def load(cls, path: str | Path, rig: str | None = None, **asked: Any) -> Self:
        """Read the file; `rig` and what is `asked` replace what it says. Raises InputError with file, line, key."""
        return load_one((cls,), path, rig, **asked)

    @classmethod
    def of(cls, top: ConfigTable, path: Path, rig: str | Rig | None = None, **asked: Any) -> Self:
        """Read the document of a file as `load` does; `rig` may be one, too."""
        kind_of(top, (cls,))
        if "computing_delay" in top:
            raise top.complaint("computing_delay", "the rig or a controller says it, here only ideal = true; remove it")
        top.allow(*meanings(cls))
        return cls.read(ExperimentFile(cls, top, path, {"rig": rig, **asked}))

    @classmethod
    def read(cls, at: ExperimentFile) -> Self:
        """What an ExperimentFile gives."""
        return cls(**{name: getattr(at, name) for name in keys_of(cls)})

    @property
    def asked(self) -> dict[str, Any]:
        """What options replace, beside the rig: a run with others is another one."""
        own = {name: getattr(self, name) for name, key in keys_of(type(self)).items() if key.asked}
        return {name: value for name, value in own.items() if value is not None}


def load_one(kinds: Sequence[type[E]], path: str | Path, rig: str | None = None, **asked: Any) -> E:
    """Read a file of one of several kinds; `rig` and what is `asked` replace what it says.

    Raises InputError with file, line and key.
    """
    path = Path(path)
    top = read_experiment(path)
    return kind_of(top, kinds).of(top, path, rig, **asked)


def kind_of(top: ConfigTable, kinds: Sequence[type[E]]) -> type[E]:
    """Which of some kinds a document is of. Raises InputError with the command that takes it."""
    kind = top.text("experiment")
    if kind not in (known := {each.KIND: each for each in kinds}):
        *others, last = (f'"{each}"' for each in known)
        listed = f"{', '.join(others)} or {last}" if others else last
        raise top.complaint("experiment", f"{echo(kind)} is not {listed}; {taker(kind)}")
    return known[kind]


Load = Callable[..., Any]  # of a path, a rig, and what options ask


def takes_experiment(
    parser: argparse.ArgumentParser,
    what: str,
    kind: type[Experiment],
    study: str,
    load: Load | None = None,
    shared: bool = False,
) -> None:
    """Make a parser that of a command on an experiment: `what` it is, and its `kind`, whose options it gets.

    `study` is what computes, such as "faults.study:run_faults", imported when it is needed. `load` reads a file that
    may be of several kinds. Where the stages are `shared`, several processes do them.
    """
    parser.add_argument("experiment", type=experiment, help=what)
    for name, key in keys_of(kind).items():
        if key.asked:
            meaning = next(iter(key.meanings.values())).partition(";")[0]
            bounded(parser, f"--{name}", 1, f"{meaning} (default: the experiment's)")
    if shared:
        works(parser)
    computes(parser, partial(_computed, kind, load or kind.load, study, shared))


def _computed(
    kind: type[Experiment], load: Load, study: str, shared: bool, options: argparse.Namespace, words: list[str]
) -> None:
    asked = {name: getattr(options, name) for name, key in keys_of(kind).items() if key.asked}
    config = load(options.experiment, options.rig, **asked)
    module, _, function = study.partition(":")
    compute = getattr(import_module(f"..{module}", __package__), function)
    work = partial(compute, config, **({"jobs": jobs(options)} if shared else {}))
    finish_experiment(options, words, module.partition(".")[0], config, work)


def finish_experiment(
    options: argparse.Namespace, words: list[str], command: str, config: Any, work: Study, prefix: str = "", **more: Any
) -> None:
    """Compute an experiment into its folder, named after a `prefix`; `more` says, too, that a run is the same one."""
    identity = {"command": command, "experiment": config.source, **config.asked, "rig": config.rig.table(), **more}
    if files := data_files(config.source):
        identity["files"] = files
    finish(options, words, f"{prefix}{Path(options.experiment).stem}", identity, work)


def taker(kind: str) -> str:
    """Which command takes an experiment of a kind."""
    if kind in OF_RUN:
        return "jackbench run takes it"
    return f"jackbench {kind} takes it" if kind in COMMANDS else nearest(kind[:80], (*OF_RUN, *COMMANDS))
