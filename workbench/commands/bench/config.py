"""The file of a bench: controllers, its own and of other experiments, on every rig of a set in every scenario."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.errors import InputError, nearest
from ...base.signals import SIGNALS, Signal
from ...base.toml import check_keys
from ...control.controller_spec import ControllerSpec, controller_spec, read_numbers
from ...loop.rig_variations import variation
from ...loop.scenarios import Scenario, scenario
from ...rigs.rig import Rig, load_rig
from ..common.experiment_file import read_experiment
from ..run.config import BodeConfig, Specimen, read_bode

KEYS = ("experiment", "rig", "rigs", "scenarios", "specimen", "from", "controllers", "bode")


@dataclass(frozen=True)
class BenchLoop:
    """The loops of one controlled signal: every controller on every rig of a set, by name, in every scenario.

    `rig` is the nominal one, with the specimen of a force. On the first of the set, the closed loop is also swept by
    the sines of `bode`.
    """

    signal: Signal
    rig: Rig
    rigs: tuple[str, ...]
    controllers: tuple[ControllerSpec, ...]
    scenarios: tuple[Scenario, ...]
    bode: BodeConfig


@dataclass(frozen=True)
class BenchConfig:
    """The loops of a bench on variations of a rig.

    `source` is the experiment file as it was read, with the tables of all its controllers.
    """

    rig: Rig
    loops: tuple[BenchLoop, ...]
    source: Mapping[str, Any]


def load_bench(path: str | Path, rig: str | None = None) -> BenchConfig:
    """Read the file of a bench; `rig` replaces the nominal one it names. Raises InputError with file and key."""
    path = Path(path)
    table = read_experiment(path)
    if table.get("experiment") != "bench":
        raise InputError(f'{path}: experiment = "{table.get("experiment")}"; a bench needs experiment = "bench"')
    check_keys(table, KEYS, str(path))
    named = rig or table.get("rig")
    if not isinstance(named, str):
        raise InputError(f'{path}: rig is missing; write rig = "jack-10t" or the path of a rig file')
    nominal = load_rig(named, None if rig else path.parent)
    tables = {**_borrowed(table.get("from", {}), path), **_own(table.get("controllers", {}), path)}
    scenarios = [scenario(name, f"{path}: scenarios") for name in _names(table.get("scenarios"), f"{path}: scenarios")]
    controllers = [controller_spec(name, part, f"{path}: [controllers.{name}]") for name, part in tables.items()]
    asked = _asked(controllers, scenarios, nominal, str(path))
    sets = _sets(table.get("rigs"), asked, f"{path}: rigs")
    sweeps = table.get("bode")
    if not isinstance(sweeps, Mapping):
        raise InputError(f"{path}: [bode] is missing; write low_hz, high_hz, points and amplitudes_percent there")
    loops = []
    for signal, players in asked.items():
        rig_of_loop = _with_specimen(nominal, table.get("specimen"), str(path)) if signal == "force" else nominal
        for name in sets[signal]:
            _check_rig(rig_of_loop, name, f"{path}: rigs")
        full = rig_of_loop.limit("force" if signal == "force" else "stroke")
        bode = read_bode(sweeps, "amplitudes_percent", full / 100, f"{path}: [bode]")
        wanted = tuple(one for one in scenarios if one.signal == signal)
        loops.append(BenchLoop(SIGNALS[signal], rig_of_loop, sets[signal], tuple(players), wanted, bode))
    source = {key: value for key, value in table.items() if key != "from"}
    return BenchConfig(nominal, tuple(loops), {**source, "controllers": tables})


def _asked(
    controllers: Sequence[ControllerSpec], scenarios: Sequence[Scenario], rig: Rig, where: str
) -> dict[str, list[ControllerSpec]]:
    """Controllers by the signal that they control and scenarios ask for, position before force."""
    controlled = {chosen.name: chosen.build(rig.period.value).measures[0] for chosen in controllers}
    asked = {wanted.signal for wanted in scenarios}
    if lonely := [name for name, signal in controlled.items() if signal not in asked]:
        raise InputError(
            f"{where}: {lonely[0]} controls the {controlled[lonely[0]]}, which no scenario asks for; add one"
        )
    if lonely := sorted(asked - set(controlled.values())):
        raise InputError(f"{where}: scenarios of the {lonely[0]}, which no controller controls; add a controller")
    return {
        signal: [chosen for chosen in controllers if controlled[chosen.name] == signal]
        for signal in sorted(asked, reverse=True)
    }


def _sets(wanted: Any, signals: Iterable[str], where: str) -> dict[str, tuple[str, ...]]:
    """The names of rigs for each signal's loops: one list for all, or a table of lists."""
    if not isinstance(wanted, Mapping):
        return dict.fromkeys(signals, _names(wanted, where, "nominal"))
    check_keys(wanted, tuple(signals), where)
    return {signal: _names(wanted.get(signal), f"{where}: {signal}", "nominal") for signal in signals}


def _with_specimen(rig: Rig, specimen: Any, where: str) -> Rig:
    if not isinstance(specimen, Mapping):
        raise InputError(f"{where}: a force needs something to act on; add a table [specimen]")
    found = read_numbers(Specimen, specimen, f"{where}: [specimen]")
    return rig.with_values(ks=found.stiffness, cs=found.damping)


def _borrowed(wanted: Any, path: Path) -> dict[str, Any]:
    """Tables of controllers from other experiment files: `[from]`, file = [names]."""
    if not isinstance(wanted, Mapping):
        raise InputError(f'{path}: [from] must be a table; write "position_step.toml" = ["p"]')
    found: dict[str, Any] = {}
    for file, names in wanted.items():
        where = f"{path}: [from] {file}"
        there = read_experiment(path.parent / file).get("controllers")
        if not isinstance(there, Mapping) or not there:
            raise InputError(f"{where}: has no controllers; name another file")
        for name in _names(names, where, *there):
            if name not in there:
                raise InputError(f'{where}: no controller "{name}"; {nearest(name, there)}')
            if name in found:
                raise InputError(f"{where}: {name} is there already; take one of the two out")
            found[name] = there[name]
    return found


def _own(tables: Any, path: Path) -> Mapping[str, Any]:
    if not isinstance(tables, Mapping) or not all(isinstance(part, Mapping) for part in tables.values()):
        raise InputError(f"{path}: controllers must be tables; write [controllers.NAME]")
    return tables


def _names(names: Any, where: str, *example: str) -> tuple[str, ...]:
    """A list of different names, one or more."""
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise InputError(f'{where}: must be a list of names; write ["{next(iter(example), "position-10mm")}"]')
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"{where}: {twice} is there twice; take one out")
    return tuple(names)


def _check_rig(rig: Rig, name: str, where: str) -> None:
    try:
        variation(rig, name)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
