"""A rig for people: every number in the unit it was written in, and what follows from the numbers."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...base.units import from_si
from ...linear import Equilibrium, equilibrium, linearise
from ...loop.capability import oil_stiffness, stall_force
from ...plant import Plant, build
from ...rigs.linear_rig import LinearRig
from ...rigs.number import Number
from ...rigs.rig import Rig
from ...rigs.schema import CONTROL, LIMITS, SHUT_OFF
from ...rigs.valve import VALVES
from ..common.columns import columns

_DROP = 70e5  # Pa: over both lands, at which servo-valves are rated
_SMALL = 1e-5  # command: well inside any lap
_BEYOND = (0.1, 0.2)  # command: well outside it
_NEAR = 1e-6  # of the largest pole: a smaller one is an integrator


def describe(rig: Rig) -> dict[str, Any]:
    """Every number of a rig in the unit it was written in, and what follows from them; JSON-able.

    `derived` rows: natural frequency and damping at mid stroke by formula and from the linearised model, rated flow,
    speed, stall force, velocity gain; of a linear plant its poles, its gain and its delay.
    """
    specs = {**rig.specs, **LIMITS, **CONTROL}
    numbers = [number_row(number, specs[number.name].meaning) for number in rig.numbers.values()]
    numbers += [number_row(number, f"limit: {LIMITS[number.name].meaning}") for number in rig.limits.values()]
    numbers += [number_row(number, CONTROL[number.name].meaning) for number in rig.control]
    if rig.shut_off:
        own = (rig.shut_off.closing_time, rig.shut_off.leak)
        numbers += [number_row(number, SHUT_OFF[number.name].meaning) for number in own]
    effects = [
        {"name": use.name, "formula": use.formula, "numbers": [number_row(n, "") for n in use.numbers.values()]}
        for use in rig.effects
    ]
    sessions = [
        {"name": name, "numbers": [number_row(number, specs[number.name].meaning) for number in own.values()]}
        for name, own in rig.sessions.items()
    ]
    kinds = {"valve": rig.valve, "corrector": rig.corrector, "jack": rig.jack}
    head = {"name": rig.name, "title": rig.title, "source": rig.source, **kinds}
    if rig.line_valve:
        head["line_valve"] = rig.line_valve.title
    return {**head, "numbers": numbers, "effects": effects, "sessions": sessions, "derived": _derived(rig)}


def describe_text(table: Mapping[str, Any]) -> str:
    """What `describe` found, for people."""
    kind = f"{table['valve']} valve, {table['jack']} jack" if table["valve"] in VALVES else "linear plant"
    kind = table.get("kind", kind) + (f", {table['line_valve']}" if "line_valve" in table else "")
    lines = [f"{table['name']}: {table['title']}", kind, table["source"], "", "Derived"]
    lines.append(columns([[row["name"], f"{row['value']:.4g} {row['unit']}", row["how"]] for row in table["derived"]]))
    lines += ["", "Numbers"]
    lines.append(columns([_number_cells(row) for row in table["numbers"]]))
    for use in table["effects"]:
        lines += [
            "",
            f"Effect {use['name']} {use['formula']}",
            columns([_number_cells(row) for row in use["numbers"]]),
        ]
    for own in table["sessions"]:
        lines += ["", f"Session {own['name']}", columns([_number_cells(row) for row in own["numbers"]])]
    return "\n".join(line.rstrip() for line in "\n".join(lines).splitlines())


def _derived(rig: Rig) -> list[dict[str, Any]]:
    return plant_rows(rig) if isinstance(rig, LinearRig) else derived(rig)


def derived(rig: Rig) -> list[dict[str, Any]]:
    """What follows from a rig's numbers: rows of name, value, unit (the shown one) and how it was found."""
    plant = build(rig)
    smooth = plant.without_dry_friction()
    rest = equilibrium(plant, p=smooth)
    by_formula, linear = _mode_formula(rig, plant, rest), _mode_linearised(plant, rest, smooth)
    flow, at, units = _rated_flow(rig)
    rows = [
        ("natural frequency", by_formula[0], "Hz", "formula, mid stroke: oil springs on the mass"),
        ("natural frequency, linearised", linear[0], "Hz", "model at rest at mid stroke, without dry friction"),
        ("damping", by_formula[1], "1", "formula, mid stroke: leakage, lap and viscous friction"),
        ("damping, linearised", linear[1], "1", "model at rest at mid stroke, without dry friction"),
        ("rated flow", float(from_si(flow, "l/min", "m^3/s")), "l/min", at),
        (
            "rated flow, all valves",
            float(from_si(rig["n"] * flow, "l/min", "m^3/s")),
            "l/min",
            f"{rig['n']:g} {units}",
        ),
    ]
    for way, sign in (("extending", 1.0), ("retracting", -1.0)):
        speed = sign * equilibrium(plant, command=sign, p=smooth).speed
        rows.append((f"no-load speed, {way}", speed, "m/s", "model, full command, steady"))
        rows.append(
            (f"stall force, {way}", 1e-3 * stall_force(rig, sign), "kN", "supply on one side, return on the other")
        )
        low, high = (equilibrium(plant, command=sign * part, p=smooth).speed for part in _BEYOND)
        gain = sign * (high - low) / (_BEYOND[1] - _BEYOND[0])
        rows.append((f"velocity gain, {way}", gain, "m/s", "model, per unit of command, beyond the lap"))
    around = [equilibrium(plant, command=_null_command(rest) + part, p=smooth).speed for part in (_SMALL, -_SMALL)]
    gain = (around[0] - around[1]) / (2 * _SMALL)
    rows.append(("velocity gain at null", gain, "m/s", "model, per unit of command, inside the lap"))
    return [dict(zip(("name", "value", "unit", "how"), row, strict=True)) for row in rows]


def _rated_flow(rig: Rig) -> tuple[float, str, str]:
    """Flow [m^3/s] of one valve, or of one pump, at full command, what it is, and what there are n of."""
    if not rig.valve_kind.has_lands:
        return rig["D"] * rig["nmax"], "one pump, full speed", "pumps"
    flow = rig["K3"] * (rig["z3max"] + rig["eps"]) * np.sqrt(_DROP / 2)
    return flow, "one valve, full command, 70 bar drop", "valves"


def _null_command(rest: Equilibrium) -> float:
    return float(rest.u[0])


def _mode_formula(rig: Rig, plant: Plant, rest: Equilibrium) -> tuple[float, float]:
    """Natural frequency [Hz] and damping [1] of the jack's mode for light damping.

    wh^2 = (kA + kB)/M with k = beta A^2/V; 2 zeta wh = b/M + sum of leakage times (pressure per travel)^2 over kA + kB.
    """
    areas = np.array(rig.areas)
    per_travel = rig["beta"] * areas / (np.array(rig.dead_volumes) + areas * rig["S"] / 2) * (-1.0, 1.0)
    stiffness = oil_stiffness(rig)
    wh = np.sqrt(stiffness / rig["M"])
    lost = float(np.sum(_land_leakage(rig, plant, rest) * per_travel**2) + rig["Cl"] * np.ptp(per_travel) ** 2)
    return float(wh / (2 * np.pi)), float((rig["b"] / rig["M"] + lost / stiffness) / (2 * wh))


def _land_leakage(rig: Rig, plant: Plant, rest: Equilibrium) -> np.ndarray:
    """Slope of the main lands' flow over the pressure of ports A and B [m^3/s/Pa] at an operating point; a pump's
    direction valves are shut at rest."""
    if not rig.valve_kind.has_lands:
        return np.zeros(2)
    outputs = plant.observe(rest.x, rest.u)[0]
    z = float(outputs[plant.output("spool")])
    to_supply, to_return = _lap(z, rig["eps"]), _lap(-z, rig["eps"])
    pa, pb = (outputs[plant.output(name)] for name in ("pa", "pb"))
    a = to_supply / np.sqrt(rig["Ps"] - pa) + to_return / np.sqrt(pa - rig["Pr"])
    b = to_return / np.sqrt(rig["Ps"] - pb) + to_supply / np.sqrt(pb - rig["Pr"])
    parted = rig.line_valve.on if rig.line_valve else (False, False)  # from the chambers, which that then does not damp
    return rig["n"] * rig["K3"] * np.where(parted, 0.0, np.array([a, b]) / 2)


def _lap(z: float, eps: float) -> float:
    return z + eps if z >= 0 else float(eps * np.exp(z / eps))


def _mode_linearised(plant: Plant, rest: Equilibrium, p: np.ndarray) -> tuple[float, float]:
    """Frequency [Hz] and damping of the oscillating mode in which the piston takes the largest part."""
    values, right = np.linalg.eig(np.asarray(linearise(plant, rest, p=p).A))
    part = np.abs(np.linalg.inv(right)[:, plant.state("v")] * right[plant.state("v")])
    part[np.imag(values) <= 0] = -1.0
    pole = values[int(np.argmax(part))]
    return float(abs(pole) / (2 * np.pi)), float(-pole.real / abs(pole))


def number_row(number: Number, meaning: str) -> dict[str, Any]:
    """A number in the unit it was written in, with its bounds, meaning and source; JSON-able."""
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


def plant_rows(rig: LinearRig) -> list[dict[str, Any]]:
    """Integrators, the other poles with frequency and damping, the gain from full command to the lowest derivative of
    the position that it moves for good, and the delay; rows of name, value, unit and how it was found."""
    a, b, c, _ = rig.state_matrices()
    poles = np.linalg.eigvals(a)
    slow = np.abs(poles) <= _NEAR * np.abs(poles).max(initial=1.0)
    rows = [("integrators", float(slow.sum()), "1", "poles at 0")]
    for pole in sorted(poles[~slow & (np.imag(poles) >= 0)], key=abs):
        word = "mode" if pole.imag else "pole"
        unstable = ", unstable" if pole.real > 0 else ""
        rows.append((f"{word}{unstable}", float(abs(pole) / (2 * np.pi)), "Hz", "of the model"))
        if pole.imag:
            rows.append(("its damping", float(-pole.real / abs(pole)), "1", "of the model"))
    gain, rates = _gain(a, b, c, int(slow.sum())), ("", "/s", "/s^2")
    if slow.sum() < len(rates):
        signal, rate = rig.signal("position"), rates[slow.sum()]
        shown = float(from_si(gain, signal.unit + rate, signal.si + rate))
        rows.append(("gain at full command", shown, signal.unit + rate, "the model at low frequency"))
    rows.append(("delay", rig.delay.value * 1e3, "ms", "of the command, without the computing delay"))
    if rig.fit is not None:
        rows.append(("error of the fit", 100 * rig.fit.error, "%", "rms over the sheet"))
    return [dict(zip(("name", "value", "unit", "how"), row, strict=True)) for row in rows]


def _gain(a: np.ndarray, b: np.ndarray, c: np.ndarray, integrators: int) -> float:
    """s^integrators G(s) well below the slowest other pole."""
    poles = np.abs(np.linalg.eigvals(a))
    s = 1e-4j * min((pole for pole in poles if pole > _NEAR * poles.max()), default=1.0)
    return float(np.real((c[0] @ np.linalg.solve(s * np.eye(len(a)) - a, b))[0] * s**integrators))
