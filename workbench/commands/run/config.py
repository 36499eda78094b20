"""Experiment files: TOML into typed, frozen configurations. A key that is not known names its nearest neighbour."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.errors import InputError, nearest
from ...base.signals import SIGNALS, Signal
from ...base.toml import check_keys
from ...base.units import to_si
from ...control.controller_spec import ControllerSpec, controller_spec, read_numbers
from ...control.protocol import design_numbers, number
from ...loop.scenarios import Scenario, scenario
from ...rigs.rig import Rig, load_rig
from ..common.experiment_file import read_experiment

if TYPE_CHECKING:
    from ...identify.datasheet.corrector import Maker


@dataclass(frozen=True)
class PaperConfig:
    """The paper's figures on a rig: `points` frequencies per curve before the corners are refined.

    `source` is the experiment file as it was read.
    """

    rig: Rig
    points: int
    source: Mapping[str, Any]


@dataclass(frozen=True)
class BodeConfig:
    """Closed-loop Bode by stepped sine: range [Hz], number of points, amplitudes of the reference (SI)."""

    low: float
    high: float
    points: int
    amplitudes: tuple[float, ...]


@design_numbers
class Specimen:
    """What the load cell is on: a spring and a damper."""

    stiffness: float = number("N/m", 1.0, 1e12, "stiffness of the specimen")
    damping: float = number("N s/m", 0.0, 1e9, "damping of the specimen")


@dataclass(frozen=True)
class StepConfig:
    """Steps of a loop: controllers x scenarios on a rig, with its closed-loop Bode. `signal` is the controlled one."""

    rig: Rig
    signal: Signal
    controllers: tuple[ControllerSpec, ...]
    scenarios: tuple[Scenario, ...]
    bode: BodeConfig
    source: Mapping[str, Any]


@design_numbers
class Corners:
    """Where a maker's curve has fallen by 3 dB, and where it is 90 degrees late."""

    f3db: float = number("Hz", 1.0, 1e4, "-3 dB")
    f90: float = number("Hz", 1.0, 1e4, "-90 deg")


@dataclass(frozen=True)
class CorrectorConfig:
    """Correctors in the spool loop, fitted to a maker's curve: `current_limit` over the rated current, least damping
    ratio at null, points per curve."""

    rig: Rig
    maker: "Maker"
    current_limit: float
    least_damping: float
    points: int
    source: Mapping[str, Any]


Config = PaperConfig | StepConfig | CorrectorConfig


def load_config(path: str | Path, rig: str | None = None) -> Config:
    """Read an experiment file; `rig` replaces the one it names. Raises InputError with file and key."""
    path = Path(path)
    table = read_experiment(path)
    kinds = {"paper": _paper, "step": step_config, "corrector": _corrector}
    kind = table.get("experiment")
    if kind in ("tune", "bench"):
        raise InputError(f'{path}: experiment = "{kind}"; jackbench {kind} takes it')
    if kind not in kinds:
        raise InputError(f'{path}: experiment = "{kind}": {nearest(str(kind), kinds)}')
    where = str(path)
    named = rig or table.get("rig")
    if not isinstance(named, str):
        raise InputError(f'{path}: rig is missing; write rig = "jack-10t" or the path of a rig file')
    return kinds[kind](table, load_rig(named, None if rig else path.parent), where)


def _paper(table: Mapping[str, Any], rig: Rig, where: str) -> PaperConfig:
    check_keys(table, ("experiment", "rig", "points"), where)
    _three_stages(rig, where)
    return PaperConfig(rig, _count(table, "points", where, 5), table)


def _three_stages(rig: Rig, where: str) -> None:
    if not rig.valve_kind.has_pilot:
        raise InputError(f"{where}: rig {rig.name} has no three-stage valve, which is what the paper is about")


def _corrector(table: Mapping[str, Any], rig: Rig, where: str) -> CorrectorConfig:
    check_keys(table, ("experiment", "rig", "points", "current_limit", "least_damping", "maker"), where)
    from ...identify.datasheet.corrector import Maker

    _three_stages(rig, where)
    maker = dict(_table(table.get("maker"), f"{where}: [maker]"))
    peak = maker.pop("peak_db", None)
    if not isinstance(peak, list) or [type(one) for one in peak] != [float] * 2 or not peak[0] <= peak[1]:
        raise InputError(f"{where}: [maker] peak_db = {peak}: write the least and the most, such as [1.0, 2.0]")
    corners = read_numbers(Corners, maker, f"{where}: [maker]")
    return CorrectorConfig(
        rig,
        Maker(corners.f3db, corners.f90, (peak[0], peak[1])),
        _positive(table.get("current_limit"), f"{where}: current_limit"),
        _positive(table.get("least_damping"), f"{where}: least_damping"),
        _count(table, "points", where, 5),
        table,
    )


def step_config(table: Mapping[str, Any], rig: Rig, where: str) -> StepConfig:
    """The tables of a step experiment on a rig; raises InputError, opened by `where`."""
    check_keys(table, ("experiment", "rig", "specimen", "scenarios", "controllers", "bode"), where)
    if "specimen" in table:
        found = read_numbers(Specimen, _table(table["specimen"], f"{where}: [specimen]"), f"{where}: [specimen]")
        rig = rig.with_values(ks=found.stiffness, cs=found.damping)
    scenarios = _scenarios(table.get("scenarios"), f"{where}: scenarios")
    signal = SIGNALS[scenarios[0].signal]
    if signal.name == "force" and not rig["ks"]:
        raise InputError(f"{where}: a force needs something to act on; add a table [specimen]")
    controllers = table.get("controllers")
    if not isinstance(controllers, Mapping) or not controllers:
        raise InputError(f"{where}: no controllers; add a table [controllers.NAME]")
    return StepConfig(
        rig,
        signal,
        tuple(
            _controller(name, part, signal, rig, f"{where}: [controllers.{name}]") for name, part in controllers.items()
        ),
        scenarios,
        read_bode(
            _table(table.get("bode"), f"{where}: [bode]"),
            f"amplitudes_{signal.unit.lower()}",
            float(to_si(1.0, signal.unit, signal.si)),
            f"{where}: [bode]",
        ),
        table,
    )


def _scenarios(names: Any, where: str) -> tuple[Scenario, ...]:
    if not isinstance(names, list) or not names:
        raise InputError(f'{where}: none; write scenarios = ["position-10mm"]')
    found = tuple(scenario(str(name), where) for name in names)
    for other in found[1:]:
        if other.signal != found[0].signal:
            raise InputError(f"{where}: {found[0].name} and {other.name} are different loops; make two experiments")
    return found


def _controller(name: str, table: Any, signal: Signal, rig: Rig, where: str) -> ControllerSpec:
    read = controller_spec(name, _table(table, where), where)
    try:
        controlled = read.build(rig.period.value).measures[0]
    except InputError as error:
        raise InputError(f"{where.removesuffix(f': [controllers.{name}]')}: {error}") from None
    if controlled != signal.name:
        hint = "give it a stiffness" if signal.name == "force" else "take its stiffness out"
        raise InputError(f"{where}: controls the {controlled}, the scenarios ask for a {signal.name}; {hint}")
    return read


def read_bode(table: Mapping[str, Any], sizes: str, si: float, where: str) -> BodeConfig:
    """Range and number of points of a sweep, and its amplitudes: the list `sizes`, each of its numbers times `si`."""
    check_keys(table, ("low_hz", "high_hz", "points", sizes), where)
    low, high = _positive(table.get("low_hz"), f"{where}: low_hz"), _positive(table.get("high_hz"), f"{where}: high_hz")
    if not low < high:
        raise InputError(f"{where}: low_hz must be below high_hz")
    given = table.get(sizes)
    if not isinstance(given, list) or not given:
        raise InputError(f"{where}: {sizes} must be a list of numbers")
    amplitudes = tuple(_positive(value, f"{where}: {sizes}") * si for value in given)
    return BodeConfig(low, high, _count(table, "points", where, 3), amplitudes)


def _table(value: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError(f"{where}: this table is missing; add it")
    return value


def _positive(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < float("inf"):
        raise InputError(f"{where} = {value}: must be a positive number")
    return float(value)


def _count(table: Mapping[str, Any], key: str, where: str, least: int) -> int:
    value = table.get(key)
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InputError(f"{where}: {key} = {value}: must be a whole number, {least} or more")
    return value
