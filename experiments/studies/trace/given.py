"""Campaigns that are there already, with their truth beside them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.base.errors import InputError
from workbench.base.files import read_json

TRUTH = "truth.json"


@dataclass(frozen=True)
class Given:
    """A campaign that is there already, and what it is short of."""

    folder: Path
    truth: dict[str, Any]

    @property
    def id(self) -> str:
        """Its name in truth.json."""
        return self.truth["id"]


def given(folder: Path) -> list[Given]:
    """The campaigns of a folder with a truth.json beside them. Raises InputError."""
    path = folder / TRUTH
    document = read_json(path)
    try:
        listed = document["campaigns"]
        items = [Given(folder / entry["id"], entry) for entry in listed]
        missing = [
            key for item in items for key in ("kind", "effects", "equation", "equations") if key not in item.truth
        ]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f'{path}: {error}; write {{"campaigns": [{{"id": ..., "kind": ...}}]}}') from None
    if missing:
        raise InputError(f'{path}: a campaign without "{missing[0]}"; add it')
    for item in items:
        if not item.folder.is_dir():
            raise InputError(f"{path}: no folder {item.folder}; remove it from the list")
    return items
