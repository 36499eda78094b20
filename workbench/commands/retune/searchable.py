"""A run or bench experiment as the search of one of its controllers: each number within a factor of what it is."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from ...base.errors import echo, nearest
from ...base.signals import SIGNALS
from ...base.table import ConfigTable
from ...base.units import from_si
from ...control.controller_spec import ControllerSpec, controller_spec
from ...control.protocol import is_number
from ...loop.tuning.problem import USUAL_WEIGHTS
from ...rigs.rig import Rig
from ..common.experiment_file import controller_tables
from ..common.scenario_tables import read_scenarios

FACTOR = 3.0  # above and below the value that a number has
DESIGNS = 60
_SHARED = ("rig", "plant", "ideal")


def searchable(top: ConfigTable, path: Path, rig: Rig, name: str | None) -> ConfigTable:
    """The tune experiment: a tune experiment itself, or that of the controller `name` of a run or bench experiment.

    A signal's scenarios that end and the bench's variations of the rig count, with the usual weights. A number that is
    0 stays. Raises InputError where there is no such controller, or no scenario for it.
    """
    kind = top.text("experiment")
    tables = controller_tables(top, path.parent)
    if kind not in ("tune", "step", "bench") or not tables:
        raise top.complaint("experiment", f"{echo(kind)} has no loops; name one of tune, run or bench that has")
    if name is None and len(tables) > 1:
        raise top.complaint("controllers", f"several; choose one: --controller {' | '.join(tables)}")
    if name is not None and name not in tables:
        raise top.complaint("controllers", f"no controller {echo(name)}; {nearest(name, tables)}")
    return top if kind == "tune" else _tune_table(top, rig, name or next(iter(tables)), tables)


def _tune_table(top: ConfigTable, rig: Rig, name: str, tables: Mapping[str, ConfigTable]) -> ConfigTable:
    spec = controller_spec(name, tables[name]).knowing(rig)
    signal = spec.build(rig.period.value).measures[0]
    scenarios = [each for each in read_scenarios(top, rig) if each.signal == signal and each.arrives is not None]
    if not scenarios:
        raise top.complaint("scenarios", f"none of the {signal} that ends, which {name} controls; add a step")
    names = [each.name for each in scenarios]
    rigs = _rigs(top, signal)
    return top.replaced(
        {
            **{key: top.values[key] for key in (*_SHARED, *["specimen"] * (signal == "force")) if key in top},
            "experiment": "tune",
            "rigs": rigs,
            "variation": {key: table for key, table in top.values.get("variation", {}).items() if key in rigs},
            "scenarios": names,
            "scenario": {key: table for key, table in top.values.get("scenario", {}).items() if key in names},
            "weights": USUAL_WEIGHTS,
            "goals": {"seconds": max(each.duration for each in scenarios)},
            "designs": DESIGNS,
            "seed": top.values.get("seed", 0),
            "controllers": {name: _widened(tables[name].values, spec)},
            "bode": _bode(top.table("bode"), signal, rig),
        }
    )


def _rigs(top: ConfigTable, signal: str) -> list[str]:
    """The nominal rig and the bench's other variations; files of other rigs are no variations of the one found."""
    listed = top.values.get("rigs", [])
    listed = listed.get(signal, []) if isinstance(listed, Mapping) else listed
    return ["nominal", *(name for name in listed if name != "nominal" and not name.endswith(".toml"))]


def _bode(bode: ConfigTable, signal: str, rig: Rig) -> dict[str, Any]:
    """With a bench's amplitudes, which are shares of what the rig can, in the signal's unit."""
    if "amplitudes_percent" not in bode:
        return dict(bode.values)
    full, shown = rig.limit("force" if signal == "force" else "stroke"), SIGNALS[signal]
    percent = bode.numbers("amplitudes_percent", "[1, 10]")
    amplitudes = [float(from_si(full / 100 * each, shown.unit, shown.si)) for each in percent]
    rest = {key: entry for key, entry in bode.values.items() if key != "amplitudes_percent"}
    return {**rest, f"amplitudes_{shown.unit.lower()}": amplitudes}


def _widened(table: Mapping[str, Any], spec: ControllerSpec) -> dict[str, Any]:
    """A controller's table whose numbers, and those of its compensators, have ends to search between."""
    limits = {entry.name: entry.metadata for entry in filter(is_number, fields(spec.design))}
    whole = {key: _range(entry, limits[key]) if key in limits else entry for key, entry in table.items()}
    parts = table.get("compensators", [])
    if parts:
        whole["compensators"] = [_widened(*pair) for pair in zip(parts, spec.compensators, strict=True)]
    return whole


def _range(entry: Any, limits: Mapping[str, Any]) -> Any:
    if not isinstance(entry, Mapping) or not {"value", "unit"} <= entry.keys() or not entry["value"] > 0:
        return entry
    value, unit = entry["value"], entry["unit"]
    least, most = (float(from_si(limits[end], unit, limits["unit"])) for end in ("low", "high"))
    low, high = max(value / FACTOR, least), min(value * FACTOR, most)
    return {**entry, "low": low, "high": high, "log": True} if low < value < high else entry
