"""What experiments of several commands have: a rig, controllers, conditions, drawn plants, a specimen, a sweep."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from ...base.table import ConfigTable
from ...control.controller_spec import ControllerSpec, controller_spec, read_numbers
from ...control.protocol import design_numbers, number
from ...loop.rig_variations import Conditions
from ...rigs.linear_file import FORMS, FREQUENCY_RESPONSE, read_linear_rig
from ...rigs.platform import is_platform
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig
from .declared import Experiment, ExperimentFile
from .experiment_file import read_experiment

E = TypeVar("E", bound=Experiment)
P = TypeVar("P", bound=Experiment)
_SHEET = ".csv"
MOST_POINTS = 1000  # of a sweep: each is a simulation
SLOWEST = 1e-3  # Hz, of a sine: a quarter of an hour a cycle
RIG = {"rig": "a bundled rig or a rig file", "plant": "a linear plant, in place of `rig`"}
BODE = {"bode": "range, points and amplitudes of a sweep by sines"}
SPECIMEN = {"specimen": "what a force acts on"}
CONTROLLERS = {"controllers": "tables of controllers, by name", "from": "controllers of other experiments, by file"}
CONDITIONS = {
    "ideal": "`true`: no computing delay, no noise, no resolution",
    "seed": "of the sensors' noise, of what is drawn, and of a search",
}


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


def rig_of(top: ConfigTable, path: Path, rig: str | Rig | None) -> Rig:
    """The rig that an experiment names, or the one that is to replace it."""
    if rig:
        return load_rig(rig) if isinstance(rig, str) else rig
    name = rig_name(top)
    return _measured_plant(top.table("plant"), name) if name.endswith(_SHEET) else load_rig(name, path.parent)


def rig_name(top: ConfigTable) -> str:
    """The rig that an experiment names: `rig`, or the file of a linear plant under the table [plant].

    With a sheet, `frequency_response = "axis.csv"` or a table with this `file`, the table has the rest of the plant.
    """
    if "plant" not in top:
        return top.text("rig")
    if "rig" in top:
        raise top.complaint("plant", "there is a rig, too; remove one")
    plant = top.table("plant")
    if isinstance(sheet := plant.values.get(FREQUENCY_RESPONSE), Mapping) and "file" in sheet:
        return plant.table(FREQUENCY_RESPONSE).text("file")
    if str(sheet).endswith(_SHEET):
        return plant.text(FREQUENCY_RESPONSE)
    plant.allow(*FORMS)
    if len(plant) != 1:
        raise plant.error('name one file, such as state_space = "plant.toml"')
    return plant.text(next(iter(plant)))


def _measured_plant(plant: ConfigTable, sheet: str) -> Rig:
    """The plant of a sheet, whose other tables are those of a plant's file."""
    model = plant.values[FREQUENCY_RESPONSE]
    tables = {**plant.values, FREQUENCY_RESPONSE: model if isinstance(model, Mapping) else {"file": sheet}}
    return read_linear_rig(plant.replaced(tables), Path(sheet).stem)


def asked_rig(at: ExperimentFile) -> Rig:
    """The rig of an experiment, or the one that is asked for instead. Raises InputError."""
    return rig_of(at.top, at.path, at.asked.get("rig"))


def asked_jack(at: ExperimentFile) -> Rig:
    """The rig that is asked for, which must be a jack."""
    rig = asked_rig(at)
    if not rig.is_jack:
        raise at.top.complaint("rig", f"{rig.name} has no chambers and no supply; name a jack")
    return rig


def on_specimen(at: ExperimentFile) -> Rig:
    """The rig, with the specimen on its load cell where the experiment has one."""
    rig = asked_rig(at)
    return with_specimen(rig, at.top.table("specimen")) if "specimen" in at.top else rig


def read_controllers(at: ExperimentFile) -> tuple[ControllerSpec, ...]:
    """The controllers of the file, its own or other files', for its rig. Raises InputError."""
    if not at.tables:
        raise at.top.complaint(
            "controllers", "no controllers; add a table [controllers.NAME], or name one under [from]"
        )
    return tuple(controller_spec(name, table).knowing(at.rig) for name, table in at.tables.items())


def sole_controller(at: ExperimentFile) -> Any:
    """The one controller of an experiment that takes no more. Raises InputError."""
    controller, *more = at.controllers
    if more:
        raise at.top.complaint("controllers", f"{1 + len(more)} of them; name one here or under [from]")
    return controller


def controlled(at: ExperimentFile, spec: ControllerSpec) -> str:
    """The name of the signal that a controller controls."""
    return spec.build(at.rig.period.value).measures[0]


def read_conditions(at: ExperimentFile) -> Conditions:
    """Under which the loops are judged."""
    return Conditions(at.top.flag("ideal", False), at.top.count("seed", 0) if "seed" in at.top else 0)


def on_platform(top: ConfigTable, path: Path, rig: str | None) -> bool:
    """Whether an experiment is on a platform: `rig`, or else the one that its file at `path` names."""
    named = rig or (top.text("rig") if "rig" in top else "")
    return is_platform(named) or is_platform(path.parent / named)


def load_either(jack: type[E], platform: type[P], path: str | Path, rig: str | None = None, **asked: Any) -> E | P:
    """Read an experiment that may be on one jack or on a platform; `rig` and what is `asked` replace what it says.

    Raises InputError with file, line and key.
    """
    path = Path(path)
    top = read_experiment(path)
    return (platform if on_platform(top, path, rig) else jack).of(top, path, rig, **asked)


def with_specimen(rig: Rig, specimen: ConfigTable) -> Rig:
    """The rig with a specimen on its load cell."""
    numbers = read_numbers(Specimen, specimen)
    return rig.with_values(ks=numbers.stiffness, cs=numbers.damping)


def read_bode(table: ConfigTable, sizes: str, si: float, rig: Rig) -> BodeConfig:
    """Range and number of points of a sweep on a rig, and its amplitudes: the list `sizes`, its numbers times `si`."""
    table.allow("low_hz", "high_hz", "points", sizes)
    low, high = table.positive("low_hz"), table.positive("high_hz")
    if not low < high:
        raise table.complaint("low_hz", "must be below high_hz")
    if low < SLOWEST:
        raise table.complaint("low_hz", f"{low:g} Hz is below {SLOWEST:g} Hz; raise it")
    if high > rig.nyquist:
        what = f"{high:g} Hz is above half the control rate of {rig.name}, {rig.nyquist:g} Hz; lower it"
        raise table.complaint("high_hz", what)
    amplitudes = table.numbers(sizes, "[1, 10]")
    if min(amplitudes) <= 0:
        raise table.complaint(sizes, f"{min(amplitudes):g}: must be positive numbers")
    points = table.count("points", 3, MOST_POINTS)
    return BodeConfig(low, high, points, tuple(amplitude * si for amplitude in amplitudes))
