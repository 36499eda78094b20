"""What there is to choose from (rigs, controllers, effects, experiments)."""

import inspect
import pkgutil
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.errors import InputError, nearest
from ...base.files import read_bytes
from ...base.toml import read_toml
from ...control.protocol import is_number
from ...rigs.platform.platform_file import bundled_platforms, platform_path
from ...rigs.rig_file import bundled
from ..common.columns import columns
from ..common.shipped import shipped

if TYPE_CHECKING:
    from ...plant.effects import EffectNumber

KINDS = ("rigs", "controllers", "effects", "experiments")
CONTROLLERS = "controllers"  # a package known by name alone: the workbench does not import it


def listing(kind: str, folder: Path = Path("experiments")) -> list[dict[str, Any]]:
    """One row for each rig, controller, effect or experiment; JSON-able.

    Experiments are those in `folder` by path, then the shipped ones by name. Raises InputError for another kind.
    """
    if kind not in KINDS:
        raise InputError(f'list "{kind}": {nearest(kind, KINDS)}')
    if kind == "rigs":
        paths = {name: _bundled_file(name) for name in bundled()}
        paths |= {name: platform_path(name) for name in bundled_platforms()}
        return [{"name": name, "title": _title(path)} for name, path in paths.items()]
    if kind == "controllers":
        return list(_controllers())
    return _effects() if kind == "effects" else _experiments(folder)


def listing_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows in aligned columns; what a row lists below itself (its numbers) and its source are for JSON."""
    if not rows:
        return "none"
    keys = [key for key in rows[0] if key != "source" and not isinstance(rows[0][key], list)]
    return columns([[str(row[key]) for key in keys] for row in rows])


def _bundled_file(rig: str) -> Path:
    return Path(str(files("workbench") / "rigs" / f"{rig}.toml"))


def _title(path: Path) -> str:
    """From the file alone: converting all of a rig's numbers takes longer than the rest of the list."""
    return read_toml(path).text("title", "")


def _controllers() -> Iterator[dict[str, Any]]:
    """Every controller and compensator, a class with a Design in a module of their package, by the name of its file."""
    for module in sorted(m.name for m in pkgutil.iter_modules(import_module(CONTROLLERS).__path__)):
        loaded = import_module(f"{CONTROLLERS}.{module}")
        classes: list[Any] = [
            c for c in vars(loaded).values() if inspect.isclass(c) and c.__module__ == loaded.__name__
        ]
        classes = [c for c in classes if hasattr(c, "Design") and c.__name__[0] != "_"]
        for law in classes:
            yield {
                "name": (module if len(classes) == 1 else _snake(law.__name__)).replace("_", "-"),
                "kind": "compensator" if hasattr(law, "into") else "controller",
                "use": f"{loaded.__name__}:{law.__name__}",
                "summary": (inspect.getdoc(law) or "").partition("\n")[0],
                "numbers": [number_row(entry) for entry in fields(law.Design)],
            }


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def number_row(entry: Any) -> dict[str, Any]:
    """A field of design numbers: its name, unit, bounds, meaning and default; what is in a file has no bounds."""
    default = None if entry.default is MISSING else entry.default
    if not is_number(entry):
        file = f"the name of a {entry.metadata['suffix']} file: {entry.metadata['meaning']}"
        return {"name": entry.name, "unit": "", "low": None, "high": None, "meaning": file, "default": default}
    return {"name": entry.name, **entry.metadata, "default": default}


def _effects() -> list[dict[str, Any]]:
    from ...plant.effects import LIBRARY

    return [
        {
            "name": effect.name,
            "formula": effect.formula,
            "equation": effect.equation,
            "family": effect.family,
            "needs": ", ".join(number.name for number in effect.numbers),
            "shows": effect.shows,
            "source": effect.source,
            "valves": sorted(effect.valves),
            "numbers": [_effect_number(number) for number in effect.numbers],
        }
        for effect in LIBRARY
    ]


def _effect_number(number: "EffectNumber") -> dict[str, Any]:
    values = {key: getattr(number, key) for key in ("typical", "low", "high", "off")}
    return {"name": number.name, "unit": number.si, **values, "meaning": number.meaning}


def _experiments(folder: Path) -> list[dict[str, Any]]:
    ours = shipped()
    here = [] if folder.resolve() == ours.resolve() else sorted(folder.glob("*.toml"))
    own = {str(path): path for path in here if path.is_file()}
    there = {path.stem: path for path in sorted(ours.glob("*.toml"))}
    campaigns = {path.parent.name: path for path in sorted(ours.glob("*/campaign.toml"))}
    return [{"name": name, "summary": _first_comment(path)} for name, path in (own | there | campaigns).items()]


def _first_comment(path: Path) -> str:
    rows = read_bytes(path).decode("utf-8-sig", errors="replace").splitlines()
    return next((row.lstrip("# ").strip() for row in rows if row[:1] == "#"), "")
