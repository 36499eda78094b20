"""The document of an experiment file: its paths made absolute, its old names replaced, its controllers gathered."""

import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...base.errors import InputError, echo, nearest
from ...base.key_lines import KeyPath
from ...base.table import ConfigTable, TableLocation
from ...base.toml import read_toml
from ...control.load_class import absolute

RENAMED = {
    "draw": "within",
    "trials": "designs",
    "over": "designed_on",
    "scenario.*.duration": "seconds",
    "record.duration": "seconds",
    "weights.settling": "settling_s",
    "weights.overshoot": "overshoot_percent",
    "weights.robustness": "ms",
    "goals.command_noise": "command_rms",
}
"""Keys that had another name up to 0.2, by their path; "*" is any name. This version still reads them."""


def read_experiment(path: Path) -> ConfigTable:
    """The document of an experiment file; a path in a controller's `use` or `network`, in a `file` or of a rig
    among `rigs`, counts from its folder, and is made absolute. A key of RENAMED has its new name, and stderr a line.

    Raises InputError with file and line.
    """
    top = _renamed(read_toml(path))
    return top.replaced(_absolute(top.values, path.parent))


def _renamed(top: ConfigTable) -> ConfigTable:
    """The document under today's names. Raises InputError for a key that is there under both."""
    old: list[KeyPath] = []
    values = with_names(top.values, (), old)
    if not old:
        return top
    lines = top.place.lines()
    for path in old:
        where, name = top.place.inside(*path), _name(path)
        if (*path[:-1], name) in lines:
            raise InputError(f"{where}: is called {name} now, which is there too; remove one")
        print(f"{where}: is called {name} now; rename it, the next version reads no other name", file=sys.stderr)
    now = {tuple(_name(path[: end + 1]) for end in range(len(path))): line for path, line in lines.items()}
    return ConfigTable(values, TableLocation(top.place.document, (), lambda: now))


def with_names(values: Mapping[str, Any], path: KeyPath, old: list[KeyPath]) -> dict[str, Any]:
    """A table of an experiment, there under `path`, under today's names; paths of keys with another join the `old`."""
    renamed = {}
    for key, entry in values.items():
        own = (*path, key)
        name = str(_name(own))
        old += [own] if name != key else []
        renamed[name] = with_names(entry, own, old) if isinstance(entry, Mapping) else entry
    return renamed


def _name(path: KeyPath) -> str | int:
    """Today's name of the last key of a path."""
    words = [str(part) for part in path]
    return RENAMED.get(".".join(words)) or RENAMED.get(".".join([words[0], "*", *words[2:]]), path[-1])


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


def controller_tables(top: ConfigTable, folder: Path) -> dict[str, ConfigTable]:
    """The tables of the controllers of an experiment, its own and those of other files, by name."""
    own = top.optional_table("controllers")
    return borrowed_controllers(top.optional_table("from"), folder) | {name: own.table(name) for name in own}


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
