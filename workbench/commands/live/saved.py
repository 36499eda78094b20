"""The numbers as an experiment that `jackbench run` takes, in the folder where the command was run."""

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...base.errors import InputError
from ...base.toml_text import toml_text
from ...base.units import from_si
from ...loop.scenarios import Scenario
from ...rigs.rig_file import bundled, rig_text
from ..common.step_experiment import load_steps
from .config import LiveConfig
from .plants import RigPoint
from .sliders import Slider
from .view import LiveTask

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_LIKE_SOURCE = ("specimen", "ideal", "seed")
Numbers = Sequence[tuple[Slider, float]]


def save_experiment(
    config: LiveConfig, name: str, moved: Mapping[str, Numbers], point: RigPoint, task: LiveTask
) -> list[Path]:
    """Write NAME.toml, and NAME-rig.toml where the rig is no bundled one or has other numbers; what was written.

    `moved`: numbers by controller, each in its unit. Raises InputError for a name that is none, or taken, and where the
    experiment cannot be run, such as a step that leaves the stroke.
    """
    if not _NAME.fullmatch(name):
        raise InputError("name: use 1 to 64 letters, digits, - and _")
    path, rig_path = Path(f"{name}.toml"), Path(f"{name}-rig.toml")
    own_rig = bool(point.values) or config.rig_name not in bundled()
    files = {path: toml_text(saved_table(config, moved, point, task, rig_path.name if own_rig else config.rig_name))}
    if own_rig:
        files = {rig_path: rig_text(config.steps.rig.with_values(**point.values)), **files}
    for file in files:
        if file.exists():
            raise InputError(f"{file} exists already; choose another name")
    _write(files)
    try:
        load_steps(path)
    except InputError as error:
        for file in files:
            file.unlink()
        raise InputError(f"not saved: {error}") from None
    return list(files)


def _write(files: Mapping[Path, str]) -> None:
    for file, text in files.items():
        try:
            with file.open("x", encoding="utf-8", newline="\n") as open_file:
                open_file.write(text)
        except OSError as error:
            raise InputError(f"{file}: cannot be written ({error.strerror}); start the command elsewhere") from None


def saved_table(
    config: LiveConfig, moved: Mapping[str, Numbers], point: RigPoint, task: LiveTask, rig: str
) -> dict[str, Any]:
    """The step experiment on a named rig, its controllers with the numbers that were moved."""
    source, steps = config.source, config.steps
    scenarios = dict(zip([s.name for s in steps.scenarios], steps.scenarios, strict=True))
    own = {name: table for name, table in source.get("scenario", {}).items() if name in scenarios}
    names = list(scenarios)
    if point.position:
        name, entry = _elsewhere(task, point.position, own.get(task.scenario.name), steps.rig.limit("stroke"))
        own, names = own | {name: entry}, [name, *(other for other in names if other != task.scenario.name)]
        own = {key: table for key, table in own.items() if key in names}
    controllers = {
        spec.name: _filled(source["controllers"][spec.name], moved.get(spec.name, ())) for spec in steps.controllers
    }
    bode, unit = steps.bode, steps.signal.unit
    sizes = [float(f"{float(from_si(a, unit, steps.signal.si)):.10g}") for a in bode.amplitudes]
    return {
        "experiment": "step",
        "rig": rig,
        **{key: source[key] for key in _LIKE_SOURCE if key in source},
        "scenarios": names,
        **({"scenario": own} if own else {}),
        "controllers": controllers,
        "bode": {
            "low_hz": bode.low,
            "high_hz": bode.high,
            "points": bode.points,
            f"amplitudes_{unit.lower()}": sizes,
        },
    }


def _elsewhere(
    task: LiveTask, position: float, own: Mapping[str, Any] | None, stroke: float
) -> tuple[str, dict[str, Any]]:
    """A scenario at another position [m], as a table of its own."""
    scenario = task.scenario
    shown = float(f"{1e3 * position:.6g}")
    start = {"start": {"value": shown, "unit": "mm"}}
    name = f"{scenario.name}-at{shown:+g}mm"
    if own is not None:
        return name, {**deepcopy(dict(own)), **start}
    return name, _table(replace(scenario, size=task.inwards(position, stroke) * scenario.size)) | start


def _table(scenario: Scenario) -> dict[str, Any]:
    """A standard scenario as a table, SI."""
    si = "m" if scenario.signal == "position" else "N"
    entries = {
        "size": (scenario.size, si),
        "frequency": (scenario.frequency or 0.0, "Hz"),
        "load": (scenario.load, "N"),
        "travel": (scenario.travel, "m"),
        "speed": (scenario.speed, "m/s"),
        "seconds": (scenario.duration, "s"),
    }
    if scenario.rate < float("inf"):
        entries["rate"] = scenario.rate, f"{si}/s"
    if scenario.load:
        entries["load_at"] = scenario.load_at, "s"
    return {"signal": scenario.signal} | {
        key: {"value": value, "unit": unit} for key, (value, unit) in entries.items() if value
    }


def _filled(table: Mapping[str, Any], moved: Numbers) -> dict[str, Any]:
    """A controller's table with other numbers, without the ranges of a search."""
    whole = _without_ranges(deepcopy(dict(table)))
    for slider, value in moved:
        part: Any = whole
        for key in slider.path[:-1]:
            part = part[key]
        part[slider.path[-1]] = {"value": value, "unit": slider.unit}
    return whole


def _without_ranges(entry: Any) -> Any:
    if isinstance(entry, list):
        return [_without_ranges(item) for item in entry]
    if isinstance(entry, Mapping):
        return {key: _without_ranges(item) for key, item in entry.items() if key not in ("low", "high", "log")}
    return entry
