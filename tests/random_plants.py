"""Seeded plants with numbers in their bounds or far beyond, random commands, and what their motion must balance.

The oil that the valve and the leakage bring into a chamber is what the piston sweeps and what is compressed; the work
of the supply is that of the load, the losses, and what oil and mass have stored. All of it is written out here again
in numpy, and integrated over samples that are made finer until the integrals no longer move.
"""

from dataclasses import dataclass, replace
from functools import cache
from random import Random
from typing import Any

import numpy as np

from workbench.engine import Engine, Trajectory
from workbench.engine.engine import TOLERANCE as ENGINE_TOLERANCE
from workbench.plant import build
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig

RIGS = ("jack-10t", "festo-tp511", "crane")
TOLERANCE = 0.01  # of what is exchanged
SECONDS = 0.2
SAMPLES = (1000, 4000, 16_000, 64_000)
FINE = 256_000, 1e-7  # samples and tolerance of the engine for what is not balanced with fewer
_RESOLVED = 0.002  # of what is exchanged: how far the integrals may move from every second sample to all
_LEAP = 0.2  # of a state's range
_OPPOSED = ("z0", "xmid")  # of either sign

Values = dict[str, Any]


@dataclass(frozen=True)
class Balance:
    """What a run gave: "balanced"; "balanced finer", which the engine's own tolerance leaves further off than a per
    cent; "unbalanced" even then; "flagged" by the engine; "unresolved" by the finest samples; "broken": neither finite
    nor flagged. `errors` are shares of what is exchanged: oil of A, of B, energy."""

    outcome: str
    errors: tuple[float, ...] = ()
    what: str = ""

    @property
    def is_wrong(self) -> bool:
        """Whether the engine gave an answer that is none."""
        return self.outcome in ("unbalanced", "broken")


def examine_plant(seed: int) -> Balance:
    """Run one random plant and hold its motion against the balances, on finer samples until they are certain."""
    random = Random(f"plant {seed}")
    rig, command, push = random_rig(random), random_command(random), random_force(random)
    what = f"{rig.name} {command}, {push:g} N"
    for samples in SAMPLES:
        run = _run(_engine(rig.name), rig, command, push, samples)
        if not run.ok:
            flagged = np.isnan(run.x[-1]).all() and np.isfinite(run.x[run.t < run.failed_at]).all()
            return Balance("flagged" if flagged else "broken", (), what)
        if not np.isfinite(run.x).all():
            return Balance("broken", (), what)
        errors, resolved = _errors(rig, run, 1), _is_resolved(rig, run)
        if resolved and np.abs(errors).max() < TOLERANCE:
            return Balance("balanced", tuple(map(float, errors)), what)
    if not resolved:
        return Balance("unresolved", tuple(map(float, errors)), what)
    samples, tolerance = FINE
    run = _run(_engine(rig.name, tolerance), rig, command, push, samples)
    fine = _errors(rig, run, 1)
    outcome = "balanced finer" if run.ok and np.abs(fine).max() < TOLERANCE else "unbalanced"
    return Balance(outcome, tuple(map(float, errors)), what)


def random_rig(random: Random) -> Rig:
    """A bundled rig with each number in its bounds, or else all of them far from what they are, where possible."""
    rig = load_rig(random.choice(RIGS))
    rig = replace(rig, effects=())
    decades = random.choice((0.0, 0.3, 1.0, 2.0))
    values = {}
    for name, number in rig.numbers.items():
        spec = rig.specs[name]
        if decades and name not in _OPPOSED:
            value = number.value * 10 ** random.uniform(-decades, decades)
        elif number.low is not None and number.high is not None:
            value = random.uniform(number.low, number.high)
        else:
            value = number.value
        values[name] = min(max(value, spec.low), spec.high)
    values["Pr"] = min(values["Pr"], 0.5 * values["Ps"])
    values["S"] = max(values["S"], 2 * rig.limits["stroke"].value)
    return rig.with_values(**values)


def random_command(random: Random) -> tuple[str, float, float]:
    """A form, an amplitude of full command, now and then beyond it, and a frequency [Hz]."""
    form = random.choice(("step", "sine", "square", "chirp"))
    return form, random.choice((0.03, 0.3, 1.0, 1.5)) * random.uniform(0.3, 1.0), 10 ** random.uniform(0, 2.3)


def random_force(random: Random) -> float:
    """A constant load [N]."""
    return random.choice((0.0, 0.0, 1.0, -1.0)) * 10 ** random.uniform(1, 4.5)


@cache
def _engine(name: str, tolerance: float = ENGINE_TOLERANCE) -> Engine:
    return Engine(build(replace(load_rig(name), effects=())), tolerance)


def _run(engine: Engine, rig: Rig, command: tuple[str, float, float], push: float, samples: int) -> Trajectory:
    """From half the supply pressure in every chamber and everything at mid stroke."""
    plant = engine.plant
    names = [name for name in plant.parameters if name in rig.numbers]
    p = plant.parameter_values(**{name: rig[name] for name in names})
    start = np.array([0.5 * rig["Ps"] if state.unit == "Pa" else state.start for state in plant.states])
    t = np.linspace(0.0, SECONDS, samples + 1)
    u = np.zeros((samples + 1, len(plant.inputs)))
    u[:, plant.input("command")] = _course(*command, t)
    u[:, plant.input("disturbance")] = push
    return engine.run(start, t, u, p)


def _course(form: str, amplitude: float, frequency: float, t: np.ndarray) -> np.ndarray:
    """The command, held over the coarsest samples, so that finer ones are of the same run."""
    held = np.floor(t * SAMPLES[0] / SECONDS + 1e-6) * SECONDS / SAMPLES[0]
    phase = 2 * np.pi * frequency * held * (held / SECONDS if form == "chirp" else 1.0)
    wave = np.sin(phase)
    return amplitude * {"step": np.where(held > 0, 1.0, 0.0), "square": np.sign(wave)}.get(form, wave)


def _errors(rig: Rig, run: Trajectory, step: int) -> np.ndarray:
    """What is missing in the oil of A, that of B, and in the energy, as shares of what is exchanged."""
    t = run.t[::step]
    s = {state.name: run.x[::step, i] for i, state in enumerate(run.plant.states)}
    force = run.u[::step, run.plant.input("disturbance")]
    for state, pressure, room in (("P1", "pa", "ra"), ("P2", "pb", "rb")):
        s[pressure], s[room] = oil(rig, s[state])
    flows, s["leak"] = _flows(rig, s), rig["Cl"] * (s["pa"] - s["pb"])
    kept = [_oil(rig, t, s, side, flow) for side, flow in (("A", flows["A"]), ("B", flows["B"]))]
    return np.array([_share(terms) for terms in (*kept, _energy(rig, t, s, flows, force))])


def _is_resolved(rig: Rig, run: Trajectory) -> bool:
    """Whether the samples show all that happens: no state leaps between two of them, and every second would do."""
    states = [run.x[:, run.plant.state(name)] for name in ("P1", "P2", "v")]
    leaps = [np.abs(np.diff(values)).max() > _LEAP * np.ptp(values) for values in states]
    return not any(leaps) and bool(np.all(np.abs(_errors(rig, run, 1) - _errors(rig, run, 2)) < _RESOLVED))


def _share(terms: list[float]) -> float:
    return sum(terms) / sum(map(abs, terms))


def _flows(rig: Rig, s: Values) -> Values:
    """Flow into A and into B [m^3/s], and power [W] from supply less return and that lost in the lands."""
    ahead, back = _lap(s["z3"], rig["eps"]), _lap(-s["z3"], rig["eps"])
    into, power, lost = {}, 0.0, 0.0
    for side, pressure, feeding, draining in (("A", s["pa"], ahead, back), ("B", s["pb"], back, ahead)):
        fed = rig["n"] * rig["K3"] * feeding * _root(rig["Ps"] - pressure)
        drained = rig["n"] * rig["K3"] * draining * _root(pressure - rig["Pr"])
        into[side] = fed - drained
        power = power + fed * rig["Ps"] - drained * rig["Pr"]
        lost = lost + fed * (rig["Ps"] - pressure) + drained * (pressure - rig["Pr"])
    return {**into, "power": power, "lost": lost}


def _lap(z: np.ndarray, eps: float) -> np.ndarray:
    return np.where(z >= 0, z + eps, eps * np.exp(np.minimum(z, 0) / eps))


def _root(drop: np.ndarray) -> np.ndarray:
    return drop / (drop**2 + 1e6) ** 0.25


def oil(rig: Rig, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pressure [Pa] of chambers' states, and volume of oil and gas per volume of oil.

    Gas, 9 % at 1 atm, fills what the oil leaves empty, (p - pv) v constant, but for what is dissolved at saturation,
    1 atm less half of the knee.
    """
    first, vapour = min(101300.0, rig["Pr"]) - 1e4, 100.0 - max(101300.0 - rig["Pr"], 0.0)
    below = np.maximum(first + 1e4 - state, 0.0)
    tension = np.where(below < 2e4, below**2 / 4e4, below - 1e4)
    empty = tension / rig["beta"]
    return state + tension - first + vapour + 9117.0 / (empty + 9117.0 / (first - vapour)), 1 + empty


def _side(rig: Rig, s: Values, side: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """State and pressure [Pa], volume [m^3] of a chamber, that of its oil and gas per oil, and what x sweeps [m^2]."""
    i, sign = (0, 1.0) if side == "A" else (1, -1.0)
    area, dead = rig.areas[i], rig.dead_volumes[i]
    volume = np.maximum(dead + area * (rig["S"] / 2 + sign * s["x"]), 0.05 * dead)
    own = (s["P1"], s["pa"], volume, s["ra"]) if side == "A" else (s["P2"], s["pb"], volume, s["rb"])
    return *own, sign * area


def _oil(rig: Rig, t: np.ndarray, s: Values, side: str, flow: np.ndarray) -> list[float]:
    """Volumes [m^3] that came through the port and past the piston, less those swept and compressed."""
    state, _, volume, room, swept = _side(rig, s, side)
    came, leaked = np.trapezoid(flow, t), np.trapezoid(-s["leak"] if side == "A" else s["leak"], t)
    return [came, leaked, -np.trapezoid(swept / room, s["x"]), -np.trapezoid(volume / rig["beta"] / room**2, state)]


def _energy(rig: Rig, t: np.ndarray, s: Values, flows: Values, force: np.ndarray) -> list[float]:
    """Work [J] of the supply, less the losses, the work of the load, and what oil and mass store."""
    terms = [np.trapezoid(flows["power"], t), -np.trapezoid(flows["lost"], t)]
    for side in "AB":
        state, pressure, volume, room, swept = _side(rig, s, side)
        terms.append(-np.trapezoid(volume / rig["beta"] / room**2 * pressure, state))
        terms.append(np.trapezoid(pressure * (1 - 1 / room) * swept, s["x"]))
    specimen = rig["ks"] * s["x"] + rig["cs"] * s["v"] + force
    terms += [-np.trapezoid(s["leak"] * (s["pa"] - s["pb"]), t), -np.trapezoid(rig["b"] * s["v"] ** 2, t)]
    terms += [-np.trapezoid(specimen, s["x"]), -np.trapezoid(_stop(rig, s), s["x"])]
    return [*terms, -0.5 * rig["M"] * (s["v"][-1] ** 2 - s["v"][0] ** 2)]


def _stop(rig: Rig, s: Values) -> np.ndarray:
    """Force [N] of the end stops."""
    force = 0.0
    for sign in (1.0, -1.0):
        into = np.maximum(sign * s["x"] - rig["S"] / 2, 0.0)
        force = force + sign * np.maximum(rig["ke"] * into + rig["ce"] * sign * s["v"] * into / (into + 1e-4), 0.0)
    return np.asarray(force)
