"""An experiment file as tables, with the files that its controllers name found beside it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...base.toml import read_toml
from ...control.load_class import absolute


def read_experiment(path: Path) -> dict[str, Any]:
    """The tables of an experiment file; every `use = "file.py:Class"` is a path from the file's folder, made absolute.

    Raises InputError.
    """
    return _absolute(read_toml(path).values, path.parent)


def _absolute(value: Any, folder: Path) -> Any:
    if isinstance(value, list):
        return [_absolute(item, folder) for item in value]
    if not isinstance(value, Mapping):
        return value
    return {
        key: absolute(item, folder) if key == "use" and isinstance(item, str) else _absolute(item, folder)
        for key, item in value.items()
    }
