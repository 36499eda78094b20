"""index.html beside the run folders: every finished run of the folder that holds them, rewritten when one finishes."""

import shlex
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from ...base.errors import InputError
from ...base.files import write_whole
from ...base.toml import read_toml
from ...report.index import MARK, FinishedRun, index_html
from .outcome import REPORT

INDEX = "index.html"
_NEXT = {
    "run": "jackbench compare {folder} ANOTHER",
    "bench": "jackbench robustness EXPERIMENT",
    "robustness": "jackbench tune EXPERIMENT",
    "tune": "jackbench run {folder}/tuned.toml",
    "retune": "jackbench run {folder}/tuned.toml",
    "time": "jackbench run {folder}/timed.toml",
    "residual": "jackbench fit {asked}",
    "fit": "jackbench trace {asked}",
    "trace": "jackbench retune EXPERIMENT --found {folder}/rig.toml",
    "record": "jackbench trace {folder}",
    "new-rig": "jackbench show {folder}/rig.toml",
}  # what follows a command, in the folder that holds the index's folder


def write_index(folder: Path) -> Path | None:
    """Write the index of the runs in a folder; its path.

    None where a file of that name is not ours, and where the folder cannot be written: the runs are whole without it.
    Another run may finish meanwhile, so it is written again until it lists what there is.
    """
    path = folder / INDEX
    with suppress(OSError):
        if path.exists() and MARK not in path.read_text(encoding="utf-8", errors="replace"):
            return None
        listed = None
        while listed != (names := _names(folder)):
            runs = sorted((_finished(folder / name) for name in names), key=lambda run: (run.date, run.name))
            write_whole(path, index_html(runs[::-1]))
            listed = names
        return path
    return None


def _names(folder: Path) -> list[str]:
    """Names of run folders: unfinished and replaced ones have names of their own."""
    names = []
    for entry in folder.iterdir():
        with suppress(OSError):
            ours = not entry.name.startswith(".") and entry.suffix != ".partial"
            if ours and (entry / "metrics.json").is_file() and (entry / "report.html").is_file():
                names.append(entry.name)
    return sorted(names)


def _finished(folder: Path) -> FinishedRun:
    """What a run's config says of it; a folder whose config cannot be read is listed by its name."""
    try:
        config = read_toml(folder / "config.toml").values
        return _described(folder, config)
    except (InputError, OSError):
        return FinishedRun(folder.name)


def _described(folder: Path, config: Mapping[str, Any]) -> FinishedRun:
    told = {key: text for key, text in _table(config, REPORT).items() if isinstance(text, str)}
    rig, files = _table(config, "rig"), sorted(path.name for path in folder.iterdir() if path.is_file())
    own = {"rig": "rig.toml" if "rig.toml" in files else "config.toml"} if rig else {}
    own |= {"experiment": "config.toml"} if _table(config, "experiment") else {}
    others = {name: name for name in files if not name.endswith((".parquet", ".html"))}
    asked = told.get("command", "")
    return FinishedRun(
        folder.name,
        told.get("title", ""),
        told.get("verdict", ""),
        str(rig.get("name", "")),
        told.get("date", ""),
        asked,
        own | others,
        sum(name.endswith(".parquet") for name in files),
        _next(str(config.get("command", "")), f"{folder.parent.name}/{folder.name}", asked, files),
    )


def _next(command: str, folder: str, asked: str, files: list[str]) -> str:
    """The command that follows; none where it takes a file that this run did not leave."""
    text = _NEXT.get(command, "")
    missing = [name for name in ("tuned.toml", "timed.toml", "rig.toml") if name in text and name not in files]
    with suppress(ValueError):
        words = shlex.split(asked)
        return "" if missing else text.format(folder=shlex.quote(folder), asked=words[2] if words[2:] else "CAMPAIGN")
    return ""


def _table(config: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A table of the config; nothing where it has none."""
    value = config.get(key)
    return value if isinstance(value, Mapping) else {}
