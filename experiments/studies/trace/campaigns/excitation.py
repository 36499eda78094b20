"""Excitations of a drawn campaign: the kinds that `jackbench record` plays, in sizes and orders that a seed decides."""

from dataclasses import dataclass

import numpy as np

from workbench.records.excitation import Excitation, excitation
from workbench.rigs.rig import Rig

from .second_order import SECOND_ORDER

STATIC, MOVING = 2.0, 6.0  # s
TRAVEL = 0.8  # of the stroke limit, at most
PUSH = 0.4  # of the force that the supply can give, to accelerate with
CROSSOVER = (2.0, 3.2)  # rad/s: the position loop holds the jack, and leaves its resonance alone
STEP_SIZES = ((0.03, 1.0), (0.3, 1.0))  # of the travel: slow, fast
STEP_RESTS = (0.15, 0.45)  # s
STEP_EDGE = 2e-3  # s: how fast a sharp move is up to its speed
SWING = (0.5, 3.0)  # Hz, of the reference of the multisine
FINE_BAND, FINE_LINES = (8.0, 330.0), 36  # Hz
QUIET, LOUD, ABOVE = 2e-3, 2e-2, 60.0  # of full command, a line; Hz, above the jack's resonance
PERIOD = 2.0  # s, of the multisine
POOR = 0.1  # of the usual size
FASTEST = 0.7  # of full speed at half the supply pressure over each land


@dataclass(frozen=True)
class Pace:
    """How fast steps (slow, fast) and triangles are [m/s], and how far the multisine goes [m]."""

    steps: tuple[tuple[float, float], ...] = ((0.03, 0.5), (0.5, 3.0))
    triangles: tuple[tuple[float, float], ...] = ((0.008, 0.03), (0.03, 0.08), (0.08, 0.25))
    swing: tuple[float, float] = (0.04, 0.15)


SHARES = Pace(((0.02, 0.2), (0.2, FASTEST)), ((0.005, 0.02), (0.02, 0.1), (0.1, 0.4)), (0.1, 0.35))
"""Of full speed and of the stroke limit, on rigs of any size."""


def excitations(rig: Rig, seed: np.random.Generator, sharp: float, poor: bool) -> tuple[Excitation, ...]:
    """static, steps, triangle and multisine, each from rest at mid stroke.

    The position loop follows the reference; the command adds what its speed takes at half the supply pressure, and for
    the multisine a fine wave. The less `sharp` (up to 1), the slower are the edges of steps and the smaller is that
    wave. `poor` ones are a tenth as large: they excite next to nothing.
    """
    period = rig.period.value
    still = excitation("static", "command", np.zeros(_rows(rig, STATIC)), period, rig["xmid"])
    velocities = {
        "steps": _steps(rig, seed, STEP_EDGE / sharp),
        "triangle": _triangles(rig, seed),
        "multisine": _swing(rig, seed),
    }
    moving = [_moving(name, velocity, rig) for name, velocity in velocities.items()]
    lines = np.unique(np.round(np.geomspace(*FINE_BAND, FINE_LINES) * PERIOD))
    fine = _waves(seed, lines, np.where(lines < ABOVE * PERIOD, QUIET, LOUD * sharp), period)
    last = moving[-1]
    moving[-1] = Excitation(last.name, period, last.reference, last.command + _repeated(fine, len(last.command)))
    size = POOR if poor else 1.0
    return (still, *(wave.scaled(size) for wave in moving))


def loop_gain(rig: Rig, seed: np.random.Generator) -> float:
    """Gain [1/m] of the position loop: command per position error."""
    return float(seed.uniform(*CROSSOVER)) / _speed(rig)


def _steps(rig: Rig, seed: np.random.Generator, edge: float) -> np.ndarray:
    """Velocities [n] m/s of moves with rests between: a fast one to the other side, then a slow one anywhere."""
    most, at = TRAVEL * rig.limit("stroke"), 0.0
    pieces, rows, side = [], 0, float(seed.choice([-1.0, 1.0]))
    while rows < _rows(rig, MOVING):
        fast = len(pieces) % 4 == 0
        side = -side if fast else float(seed.choice([-1.0, 1.0]))
        goal = side * most * _log_uniform(seed, STEP_SIZES[fast])
        rest = np.zeros(_rows(rig, seed.uniform(*STEP_RESTS)))
        pieces += [_move(goal - at, _log_uniform(seed, _pace(rig).steps[fast]), _rows(rig, edge), fast, rig), rest]
        rows, at = rows + len(pieces[-2]) + len(rest), goal
    return np.concatenate(pieces)[: _rows(rig, MOVING)]


def _triangles(rig: Rig, seed: np.random.Generator) -> np.ndarray:
    """Velocities [n] m/s of triangles about mid stroke, fast to so slow that friction shows, in any order."""
    pieces, speeds = [], _pace(rig).triangles
    for band in seed.permutation(speeds):
        speed, cycles = _log_uniform(seed, band), int(seed.integers(1, 3))
        edge = max(4, _rows(rig, np.pi / 2 * speed / _acceleration(rig)))
        flat = max(4, _rows(rig, MOVING / len(speeds) / cycles) // 4 - edge // 2)
        turn = np.cos(np.pi * (np.arange(edge) + 0.5) / edge)
        wave = np.concatenate((np.ones(flat), turn, -np.ones(2 * flat), -turn, np.ones(flat)))
        pieces.append(float(seed.choice([-1.0, 1.0])) * speed * np.tile(wave, cycles))
    velocity = np.concatenate(pieces)
    return np.concatenate((velocity, np.zeros(_rows(rig, MOVING))))[: _rows(rig, MOVING)]


def _swing(rig: Rig, seed: np.random.Generator) -> np.ndarray:
    """Velocities [n] m/s of a multisine that moves the jack, so that the valve works away from null."""
    period = rig.period.value
    lines = np.arange(round(SWING[0] * PERIOD), round(SWING[1] * PERIOD) + 1)
    wave = _waves(seed, lines, 1 / lines, period)
    wave *= seed.uniform(*_pace(rig).swing) / np.abs(wave).max()
    speed = np.gradient(np.concatenate((wave, wave, wave)), period)[len(wave) : 2 * len(wave)]
    hardest, fastest = np.abs(np.gradient(speed, period)).max(), np.abs(speed).max()
    size = min(1.0, _acceleration(rig) / hardest, FASTEST * _speed(rig) / fastest)
    return _repeated(speed * size, _rows(rig, MOVING))


def _move(displacement: float, speed: float, edge: int, fast: bool, rig: Rig) -> np.ndarray:
    """Velocities [n] m/s of a move, up to `speed` [m/s] in `edge` rows: a fast one then brakes evenly, no harder than
    PUSH allows; a slow one keeps its speed and stops as it started."""
    size, period = abs(displacement), rig.period.value
    seconds = max(np.sqrt(2 * size / _acceleration(rig)), 2 * size / speed) if fast else size / speed
    rows = max(2 * edge, round(seconds / period))
    rise = np.minimum(1.0, (np.arange(rows) + 0.5) / edge)
    shape = rise * (1 - (np.arange(rows) + 0.5) / rows) if fast else np.minimum(rise, rise[::-1])
    return displacement * shape / (shape.sum() * period)


def _moving(name: str, velocity: np.ndarray, rig: Rig) -> Excitation:
    period = rig.period.value
    travelled = np.concatenate(([0.0], np.cumsum(velocity)[:-1])) * period
    return Excitation(name, period, rig["xmid"] + travelled, velocity / _speed(rig))


def _speed(rig: Rig) -> float:
    """Jack speed per unit of command [m/s], half the supply pressure over each land."""
    return rig["n"] * rig["K3"] * rig["z3max"] * np.sqrt((rig["Ps"] - rig["Pr"]) / 2) / (sum(rig.areas) / 2)


def _pace(rig: Rig) -> Pace:
    if rig.valve != SECOND_ORDER:
        return Pace()
    top, far = _speed(rig), rig.limit("stroke")
    steps, triangles = (
        tuple((low * top, high * top) for low, high in bands) for bands in (SHARES.steps, SHARES.triangles)
    )
    return Pace(steps, triangles, (SHARES.swing[0] * far, SHARES.swing[1] * far))


def _rows(rig: Rig, seconds: float) -> int:
    return round(seconds / rig.period.value)


def _acceleration(rig: Rig) -> float:
    return PUSH * (rig["Ps"] - rig["Pr"]) * min(rig.areas) / rig["M"]


def _waves(seed: np.random.Generator, lines: np.ndarray, sizes: np.ndarray, period: float) -> np.ndarray:
    """One period [n] of the lines, in cycles a period, with these sizes and drawn phases."""
    phases = seed.uniform(0, 2 * np.pi, len(lines))
    part = np.arange(round(PERIOD / period)) / round(PERIOD / period)
    return sizes @ np.cos(2 * np.pi * np.outer(lines, part) + phases[:, None])


def _repeated(wave: np.ndarray, rows: int) -> np.ndarray:
    return np.resize(wave, rows)


def _log_uniform(seed: np.random.Generator, band: tuple[float, float]) -> float:
    return float(np.exp(seed.uniform(*np.log(band))))
