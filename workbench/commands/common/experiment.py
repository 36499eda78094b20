"""What experiment files of several commands share: the rig, a sweep by sines, a specimen, files of one's own laws."""

from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...base.errors import echo, nearest
from ...base.table import ConfigTable
from ...base.toml import read_toml
from ...control.controller_spec import read_numbers
from ...control.load_class import absolute
from ...control.protocol import design_numbers, number
from ...loop.rig_variations import Conditions
from ...rigs.linear_file import FORMS, FREQUENCY_RESPONSE, read_linear_rig
from ...rigs.platform import is_platform
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig

_SHEET = ".csv"
MOST_POINTS = 1000  # of a sweep: each is a simulation
SLOWEST = 1e-3  # Hz, of a sine: a quarter of an hour a cycle


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


def read_experiment(path: Path) -> ConfigTable:
    """The document of an experiment file; a path in a controller's `use` or `network`, in a `file` or of a rig
    among `rigs`, counts from its folder, and is made absolute.

    Raises InputError with file and line.
    """
    top = read_toml(path)
    return top.replaced(_absolute(top.values, path.parent))


def _absolute(value: Any, folder: Path) -> Any:
    if isinstance(value, list):
        return [_absolute(item, folder) for item in value]
    if not isinstance(value, Mapping):
        return value
    return {key: _absolute_entry(key, item, folder) for key, item in value.items()}


def _absolute_entry(key: str, item: Any, folder: Path) -> Any:
    if key == "use" and isinstance(item, str):
        return absolute(item, folder)
    if key in ("file", "network") and isinstance(item, str):
        return str((folder / item).resolve())
    if key == "rigs":
        return _absolute_rigs(item, folder)
    return _absolute(item, folder)


def _absolute_rigs(item: Any, folder: Path) -> Any:
    """The list of rigs, or the table of lists, with the paths of rig files."""
    if isinstance(item, Mapping):
        return {key: _absolute_rigs(entry, folder) for key, entry in item.items()}
    if not isinstance(item, list):
        return item
    return [str((folder / name).resolve()) if str(name).endswith(".toml") else name for name in item]


def data_files(source: Mapping[str, Any]) -> dict[str, str]:
    """Digests of the files that scenarios, a record, the set of rigs and policies of an experiment name, by path."""
    rigs = source.get("rigs", [])
    lists = rigs.values() if isinstance(rigs, Mapping) else [rigs]
    paths = [name for names in lists for name in names if name.endswith(".toml")]
    courses = [*source.get("scenario", {}).values(), source.get("record", {})]
    paths += [table["file"] for table in courses if "file" in table]
    paths += [source["network"]] if isinstance(source.get("network"), str) else []
    for controller in source.get("controllers", {}).values():
        paths += [part["network"] for part in (controller, *controller.get("compensators", [])) if "network" in part]
    return {path: sha256(Path(path).read_bytes()).hexdigest() for path in paths}


def rig_of(top: ConfigTable, path: Path, rig: str | None) -> Rig:
    """The rig that an experiment names, or the one that is to replace it."""
    if rig:
        return load_rig(rig)
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


def read_conditions(top: ConfigTable) -> Conditions:
    """Under which the loops are judged: `ideal = true`, or the `seed` of the sensors' noise."""
    return Conditions(top.flag("ideal", False), top.count("seed", 0) if "seed" in top else 0)


def on_platform(top: ConfigTable, path: Path, rig: str | None) -> bool:
    """Whether an experiment is on a platform: `rig`, or else the one that its file at `path` names."""
    named = rig or (top.text("rig") if "rig" in top else "")
    return is_platform(named) or is_platform(path.parent / named)


def borrowed_controllers(table: ConfigTable, folder: Path) -> dict[str, ConfigTable]:
    """Tables of controllers from other experiment files: `[from]`, file = [names]."""
    borrowed: dict[str, ConfigTable] = {}
    for file in table:
        there = read_experiment(folder / file).optional_table("controllers")
        if not len(there):
            raise table.complaint(file, "has no controllers; name another file")
        for name in table.words(file, next(iter(there))):
            if name not in there:
                raise table.complaint(file, f"no controller {echo(name)}; {nearest(name[:80], there)}")
            if name in borrowed:
                raise table.complaint(file, f"{name} is there already; take one of the two out")
            borrowed[name] = there.table(name)
    return borrowed


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
