"""The file of a stage: what was computed once, as JSON with its arrays beside it, under a digest of both."""

import json
from collections.abc import Callable, Mapping
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from ...base.files import sync, write_whole

_ARRAY = "__array__"
_LONGEST_NAME = 100


def stage_path(folder: Path, stage: str) -> Path:
    """A file for a stage, with a digest in its name where that is too long or has capitals: some disks know no case."""
    name = quote(stage, safe="")
    if len(name) > _LONGEST_NAME or stage != stage.lower():
        name = f"{name[:_LONGEST_NAME]}-{sha256(name.encode()).hexdigest()[:16]}"
    return folder / f"{name}.json"


class Unreadable(Exception):
    """A stage is not there as it was written."""


def store_stage(path: Path, result: object) -> None:
    """Write a stage. The JSON file comes last: it is what says that the stage is done, by the digest of all of it."""
    arrays: list[np.ndarray] = []

    def leaf(value: object) -> object:
        if isinstance(value, np.ndarray) and not value.dtype.hasobject:
            arrays.append(value)
            return {_ARRAY: f"arr_{len(arrays) - 1}"}  # the name that savez gives it
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, (str, int, float)):
            return value
        raise TypeError(f"a stage's result is made of dict, list, numbers, str, None and arrays, not {type(value)}")

    text, beside = json.dumps(plain(result, leaf)), path.with_suffix(".npz")
    beside.unlink(missing_ok=True)
    if arrays:
        with beside.open("wb") as file:
            np.savez(file, *arrays)
        sync(beside)
    write_whole(path, f"{_digest(text, beside)}\n{text}")


def load_stage(path: Path) -> Any:
    """What `_store` wrote. Raises Unreadable where it is not whole."""
    beside = path.with_suffix(".npz")
    arrays: dict[str, np.ndarray] = {}
    try:
        digest, _, text = path.read_text(encoding="utf-8").partition("\n")
        if digest != _digest(text, beside):
            raise Unreadable
        if beside.exists():
            with np.load(beside, allow_pickle=False) as file:
                arrays = dict(file)
    except (OSError, UnicodeDecodeError):
        raise Unreadable from None

    def whole(value: dict[str, Any]) -> Any:
        return arrays[value[_ARRAY]] if value.keys() == {_ARRAY} else value

    return json.loads(text, object_hook=whole)


def _digest(text: str, beside: Path) -> str:
    """The digest of a stage: its JSON, and the file of its arrays where there is one."""
    digest = sha256(text.encode())
    if beside.exists():
        with beside.open("rb") as file:
            digest.update(file_digest(file, "sha256").digest())
    return digest.hexdigest()


def plain(value: object, leaf: Callable[[object], object]) -> object:
    """`value` with every leaf replaced. Raises TypeError for a key that is no string."""
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"keys are str, not {key!r}")
        return {key: plain(item, leaf) for key, item in value.items()}
    if isinstance(value, list):
        return [plain(item, leaf) for item in value]
    return leaf(value)
