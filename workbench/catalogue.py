"""What there is to choose from (rigs, controllers, effects, experiments), and what follows from a rig's numbers."""

import inspect
import pkgutil
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from .errors import InputError, nearest
from .plant import Plant, build
from .plant.effects import LIBRARY, EffectNumber
from .rig import Number, Rig, bundled, load_rig, number_specs
from .rig_schema import CONTROL, LIMITS
from .units import from_si
from .views import Equilibrium, equilibrium, linearise

KINDS = ("rigs", "controllers", "effects", "experiments")
CONTROLLERS = "controllers"  # a package known by name alone: the workbench does not import it
_DROP = 70e5  # Pa: over both lands, at which servo-valves are rated
_SMALL = 1e-5  # command: well inside any lap
_BEYOND = (0.1, 0.2)  # command: well outside it


def listing(kind: str, folder: Path = Path("experiments")) -> list[dict[str, Any]]:
    """One row for each rig, controller, effect or experiment (those in `folder`); JSON-able.

    Raises InputError for another kind, and for experiments where there is no such folder.
    """
    if kind not in KINDS:
        raise InputError(f'list "{kind}": {nearest(kind, KINDS)}')
    if kind == "rigs":
        return [{"name": name, "title": load_rig(name).title} for name in bundled()]
    if kind == "controllers":
        return list(_controllers())
    return _effects() if kind == "effects" else _experiments(folder)


def listing_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows in aligned columns; what a row lists below itself (its numbers) and its source are for JSON."""
    if not rows:
        return "none"
    keys = [key for key in rows[0] if key != "source" and not isinstance(rows[0][key], list)]
    return _columns([[str(row[key]) for key in keys] for row in rows])


def describe(rig: Rig) -> dict[str, Any]:
    """Every number of a rig in the unit it was written in, and what follows from them; JSON-able.

    `derived` rows: natural frequency and damping at mid stroke by formula and from the linearised model, rated flow,
    speed, stall force, velocity gain.
    """
    specs = number_specs(rig.valve, rig.corrector, rig.jack) | LIMITS | CONTROL
    numbers = [_number(number, specs[number.name].meaning) for number in rig.numbers.values()]
    numbers += [_number(number, f"limit: {LIMITS[number.name].meaning}") for number in rig.limits.values()]
    numbers.append(_number(rig.period, CONTROL["period"].meaning))
    effects = [
        {"name": use.name, "formula": use.formula, "numbers": [_number(n, "") for n in use.numbers.values()]}
        for use in rig.effects
    ]
    kinds = {"valve": rig.valve, "corrector": rig.corrector, "jack": rig.jack}
    head = {"name": rig.name, "title": rig.title, "source": rig.source, **kinds}
    return {**head, "numbers": numbers, "effects": effects, "derived": derived(rig)}


def describe_text(table: Mapping[str, Any]) -> str:
    """What `describe` found, for people."""
    kind = f"{table['valve']} valve, {table['jack']} jack"
    lines = [f"{table['name']}: {table['title']}", kind, table["source"], "", "Derived"]
    lines.append(_columns([[row["name"], f"{row['value']:.4g} {row['unit']}", row["how"]] for row in table["derived"]]))
    lines += ["", "Numbers"]
    lines.append(_columns([_number_cells(row) for row in table["numbers"]]))
    for use in table["effects"]:
        lines += [
            "",
            f"Effect {use['name']} {use['formula']}",
            _columns([_number_cells(row) for row in use["numbers"]]),
        ]
    return "\n".join(line.rstrip() for line in "\n".join(lines).splitlines())


def derived(rig: Rig) -> list[dict[str, Any]]:
    """What follows from a rig's numbers: rows of name, value, unit (the shown one) and how it was found."""
    plant = build(rig)
    smooth = plant.without_dry_friction()
    rest = equilibrium(plant, p=smooth)
    by_formula, linear = _mode_formula(rig, plant, rest), _mode_linearised(plant, rest, smooth)
    flow = rig["K3"] * (rig["z3max"] + rig["eps"]) * np.sqrt(_DROP / 2)
    rows = [
        ("natural frequency", by_formula[0], "Hz", "formula, mid stroke: oil springs on the mass"),
        ("natural frequency, linearised", linear[0], "Hz", "model at rest at mid stroke, without dry friction"),
        ("damping", by_formula[1], "1", "formula, mid stroke: leakage, lap and viscous friction"),
        ("damping, linearised", linear[1], "1", "model at rest at mid stroke, without dry friction"),
        ("rated flow", float(from_si(flow, "l/min", "m^3/s")), "l/min", "one valve, full command, 70 bar drop"),
        ("rated flow, all valves", float(from_si(rig["n"] * flow, "l/min", "m^3/s")), "l/min", f"{rig['n']:g} valves"),
    ]
    for way, sign in (("extending", 1.0), ("retracting", -1.0)):
        speed = sign * equilibrium(plant, command=sign, p=smooth).speed
        rows.append((f"no-load speed, {way}", speed, "m/s", "model, full command, steady"))
        rows.append(
            (f"stall force, {way}", 1e-3 * _stall_force(rig, sign), "kN", "supply on one side, return on the other")
        )
        low, high = (equilibrium(plant, command=sign * part, p=smooth).speed for part in _BEYOND)
        gain = sign * (high - low) / (_BEYOND[1] - _BEYOND[0])
        rows.append((f"velocity gain, {way}", gain, "m/s", "model, per unit of command, beyond the lap"))
    around = [equilibrium(plant, command=_null_command(rest) + part, p=smooth).speed for part in (_SMALL, -_SMALL)]
    gain = (around[0] - around[1]) / (2 * _SMALL)
    rows.append(("velocity gain at null", gain, "m/s", "model, per unit of command, inside the lap"))
    return [dict(zip(("name", "value", "unit", "how"), row, strict=True)) for row in rows]


def _null_command(rest: Equilibrium) -> float:
    return float(rest.u[0])


def _areas(rig: Rig) -> tuple[float, float]:
    return (rig["Aj"], rig["Aj"]) if rig.jack == "double-rod" else (rig["AA"], rig["AB"])


def _stall_force(rig: Rig, sign: float) -> float:
    """Force [N] with the supply on the driving side and the return on the other."""
    driving, driven = _areas(rig)[:: int(sign)]
    return rig["Ps"] * driving - rig["Pr"] * driven


def _mode_formula(rig: Rig, plant: Plant, rest: Equilibrium) -> tuple[float, float]:
    """Natural frequency [Hz] and damping [1] of the jack's mode for light damping.

    wh^2 = (kA + kB)/M with k = beta A^2/V; 2 zeta wh = b/M + sum of leakage times (pressure per travel)^2 over kA + kB.
    """
    areas = np.array(_areas(rig))
    dead = (rig["V0"], rig["V0"]) if rig.jack == "double-rod" else (rig["V0A"], rig["V0B"])
    per_travel = rig["beta"] * areas / (np.array(dead) + areas * rig["S"] / 2) * (-1.0, 1.0)
    stiffness = float(np.sum(np.abs(per_travel) * areas))
    wh = np.sqrt(stiffness / rig["M"])
    lost = float(np.sum(_land_leakage(rig, plant, rest) * per_travel**2) + rig["Cl"] * np.ptp(per_travel) ** 2)
    return float(wh / (2 * np.pi)), float((rig["b"] / rig["M"] + lost / stiffness) / (2 * wh))


def _land_leakage(rig: Rig, plant: Plant, rest: Equilibrium) -> np.ndarray:
    """Slope of the main lands' flow over the pressure of ports A and B [m^3/s/Pa] at an operating point."""
    seen = plant.observe(rest.x, rest.u)[0]
    z = float(seen[plant.output("spool")])
    to_supply, to_return = _lap(z, rig["eps"]), _lap(-z, rig["eps"])
    pa, pb = (seen[plant.output(name)] for name in ("pa", "pb"))
    a = to_supply / np.sqrt(rig["Ps"] - pa) + to_return / np.sqrt(pa - rig["Pr"])
    b = to_return / np.sqrt(rig["Ps"] - pb) + to_supply / np.sqrt(pb - rig["Pr"])
    return rig["n"] * rig["K3"] * np.array([a, b]) / 2


def _lap(z: float, eps: float) -> float:
    return z + eps if z >= 0 else float(eps * np.exp(z / eps))


def _mode_linearised(plant: Plant, rest: Equilibrium, p: np.ndarray) -> tuple[float, float]:
    """Frequency [Hz] and damping of the oscillating mode in which the piston takes the largest part."""
    values, right = np.linalg.eig(np.asarray(linearise(plant, rest, p=p).A))
    part = np.abs(np.linalg.inv(right)[:, plant.state("v")] * right[plant.state("v")])
    part[np.imag(values) <= 0] = -1.0
    pole = values[int(np.argmax(part))]
    return float(abs(pole) / (2 * np.pi)), float(-pole.real / abs(pole))


def _controllers() -> Iterator[dict[str, Any]]:
    """Every controller and compensator, a class with a Design in a module of their package, by the name of its file."""
    for module in sorted(m.name for m in pkgutil.iter_modules(import_module(CONTROLLERS).__path__)):
        loaded = import_module(f"{CONTROLLERS}.{module}")
        found: list[Any] = [c for c in vars(loaded).values() if inspect.isclass(c) and c.__module__ == loaded.__name__]
        found = [c for c in found if hasattr(c, "Design") and c.__name__[0] != "_"]
        for chosen in found:
            yield {
                "name": (module if len(found) == 1 else _snake(chosen.__name__)).replace("_", "-"),
                "kind": "compensator" if hasattr(chosen, "into") else "controller",
                "use": f"{loaded.__name__}:{chosen.__name__}",
                "summary": (inspect.getdoc(chosen) or "").partition("\n")[0],
                "numbers": [_design_number(entry) for entry in fields(chosen.Design)],
            }


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def _design_number(entry: Any) -> dict[str, Any]:
    default = None if entry.default is MISSING else entry.default
    return {"name": entry.name, **entry.metadata, "default": default}


def _effects() -> list[dict[str, Any]]:
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


def _effect_number(number: EffectNumber) -> dict[str, Any]:
    values = {key: getattr(number, key) for key in ("typical", "low", "high", "off")}
    return {"name": number.name, "unit": number.si, **values, "meaning": number.meaning}


def _experiments(folder: Path) -> list[dict[str, Any]]:
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; call it where your experiments/ is")
    rows = []
    for path in sorted(folder.glob("*.toml")):
        comments = (line.lstrip("# ").strip() for line in path.read_text("utf-8-sig").splitlines() if line[:1] == "#")
        rows.append({"name": str(path), "summary": next(comments, "")})
    return rows


def _number(number: Number, meaning: str) -> dict[str, Any]:
    ends = (
        None if end is None else _short(float(from_si(end, number.unit, number.si)))
        for end in (number.low, number.high)
    )
    return {
        "name": number.name,
        "value": _short(number.shown),
        "unit": number.unit,
        "bounds": None if number.low is None else list(ends),
        "meaning": meaning,
        "source": number.source,
    }


def _short(value: float) -> float:
    """Without the last digits, which a conversion of units leaves behind."""
    return float(f"{value:.12g}")


def _number_cells(row: Mapping[str, Any]) -> list[str]:
    bounds = "" if row["bounds"] is None else "{:.5g} to {:.5g}".format(*row["bounds"])
    return [row["name"], f"{row['value']:.6g}", row["unit"], bounds, row["meaning"], row["source"]]


def _columns(rows: Sequence[Sequence[str]]) -> str:
    """Left-aligned columns, two spaces apart; the last one runs free."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)] if rows else []
    return "\n".join("  ".join([*(c.ljust(w) for c, w in zip(row, widths, strict=False)), row[-1]]) for row in rows)
