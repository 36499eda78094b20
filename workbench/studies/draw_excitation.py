"""Excitations of a drawn campaign: the kinds that `jackbench record` plays, in sizes and orders that a seed decides."""

import numpy as np

from ..excitation import Excitation, excitation
from ..rig import Rig

STATIC, MOVING = 2.0, 6.0  # s
TRAVEL = 0.8  # of the stroke limit, at most
PUSH = 0.4  # of the force that the supply can give, to accelerate with
CROSSOVER = (2.0, 3.2)  # rad/s: the position loop holds the jack, and leaves its resonance alone
STEP_SIZES = ((0.03, 1.0), (0.3, 1.0))  # of the travel: slow, fast
STEP_SPEEDS = ((0.03, 0.5), (0.5, 3.0))  # m/s
STEP_RESTS = (0.15, 0.45)  # s
TRIANGLE_SPEEDS = ((0.008, 0.03), (0.03, 0.08), (0.08, 0.25))  # m/s
SWING, SWING_LINES = (0.5, 3.0), (0.04, 0.15)  # Hz; m, the reference of the multisine
FINE, FINE_BAND, FINE_LINES = (0.015, 0.04), (5.0, 250.0), 50  # of full command, peak; Hz
PERIOD = 2.0  # s, of the multisine
POOR = 0.1  # of the usual size


def excitations(rig: Rig, seed: np.random.Generator, poor: bool) -> tuple[Excitation, ...]:
    """static, steps, triangle and multisine, each from rest at mid stroke.

    The position loop follows the reference; the command adds what its speed takes at half the supply pressure, and for
    the multisine a fine wave. `poor` ones are a tenth as large: they excite next to nothing.
    """
    period = rig.period.value
    still = excitation("static", "command", np.zeros(_rows(rig, STATIC)), period, rig["xmid"])
    velocities = {"steps": _steps(rig, seed), "triangle": _triangles(rig, seed), "multisine": _swing(rig, seed)}
    moving = [_moving(name, velocity, rig) for name, velocity in velocities.items()]
    fine = _waves(seed, FINE_BAND, FINE_LINES, period) * seed.uniform(*FINE)
    last = moving[-1]
    moving[-1] = Excitation(last.name, period, last.reference, last.command + _repeated(fine, len(last.command)))
    size = POOR if poor else 1.0
    return (still, *(one.scaled(size) for one in moving))


def loop_gain(rig: Rig, seed: np.random.Generator) -> float:
    """Gain [1/m] of the position loop: command per position error."""
    return float(seed.uniform(*CROSSOVER)) / _speed(rig)


def _steps(rig: Rig, seed: np.random.Generator) -> np.ndarray:
    """Velocities [n] m/s of moves with rests between them: a fast one to the other side, then a slow one anywhere."""
    most, at = TRAVEL * rig.limit("stroke"), 0.0
    pieces, rows, side = [], 0, float(seed.choice([-1.0, 1.0]))
    while rows < _rows(rig, MOVING):
        fast = len(pieces) % 4 == 0
        side = -side if fast else float(seed.choice([-1.0, 1.0]))
        goal = side * most * _log_uniform(seed, STEP_SIZES[fast])
        rest = np.zeros(_rows(rig, seed.uniform(*STEP_RESTS)))
        pieces += [_move(goal - at, _log_uniform(seed, STEP_SPEEDS[fast]), rig), rest]
        rows, at = rows + len(pieces[-2]) + len(rest), goal
    return np.concatenate(pieces)[: _rows(rig, MOVING)]


def _triangles(rig: Rig, seed: np.random.Generator) -> np.ndarray:
    """Velocities [n] m/s of triangles about mid stroke, fast to so slow that friction shows, in any order."""
    pieces = []
    for band in seed.permutation(TRIANGLE_SPEEDS):
        speed, cycles = _log_uniform(seed, band), int(seed.integers(1, 3))
        edge = max(4, _rows(rig, np.pi / 2 * speed / _acceleration(rig)))
        flat = max(4, _rows(rig, MOVING / len(TRIANGLE_SPEEDS) / cycles) // 4 - edge // 2)
        turn = np.cos(np.pi * (np.arange(edge) + 0.5) / edge)
        wave = np.concatenate((np.ones(flat), turn, -np.ones(2 * flat), -turn, np.ones(flat)))
        pieces.append(float(seed.choice([-1.0, 1.0])) * speed * np.tile(wave, cycles))
    velocity = np.concatenate(pieces)
    return np.concatenate((velocity, np.zeros(_rows(rig, MOVING))))[: _rows(rig, MOVING)]


def _swing(rig: Rig, seed: np.random.Generator) -> np.ndarray:
    """Velocities [n] m/s of a multisine that moves the jack, so that the valve works away from null."""
    period = rig.period.value
    wave = _waves(seed, SWING, 6, period, falling=True) * seed.uniform(*SWING_LINES)
    speed = np.gradient(np.concatenate((wave, wave, wave)), period)[len(wave) : 2 * len(wave)]
    fastest = np.abs(np.gradient(speed, period)).max()
    return _repeated(speed * min(1.0, _acceleration(rig) / fastest), _rows(rig, MOVING))


def _move(displacement: float, speed: float, rig: Rig) -> np.ndarray:
    """Velocities [n] m/s of a move along half a cosine: at most `speed` [m/s], and no harder than PUSH allows."""
    size, period = abs(displacement), rig.period.value
    seconds = max(np.pi * np.sqrt(size / (2 * _acceleration(rig))), np.pi * size / (2 * speed))
    rows = max(4, round(seconds / period))
    shape = np.sin(np.pi * (np.arange(rows) + 0.5) / rows)
    return displacement * shape / (shape.sum() * period)


def _moving(name: str, velocity: np.ndarray, rig: Rig) -> Excitation:
    period = rig.period.value
    travelled = np.concatenate(([0.0], np.cumsum(velocity)[:-1])) * period
    return Excitation(name, period, rig["xmid"] + travelled, velocity / _speed(rig))


def _speed(rig: Rig) -> float:
    """Jack speed per unit of command [m/s], half the supply pressure over each land."""
    return rig["n"] * rig["K3"] * rig["z3max"] * np.sqrt((rig["Ps"] - rig["Pr"]) / 2) / rig["Aj"]


def _rows(rig: Rig, seconds: float) -> int:
    return round(seconds / rig.period.value)


def _acceleration(rig: Rig) -> float:
    return PUSH * (rig["Ps"] - rig["Pr"]) * rig["Aj"] / rig["M"]


def _waves(
    seed: np.random.Generator, band: tuple[float, float], count: int, period: float, falling: bool = False
) -> np.ndarray:
    """One period [n] of log-spaced lines with drawn phases, peak 1; `falling` sizes go as 1/f."""
    lines = np.unique(np.round(np.geomspace(*band, count) * PERIOD))
    sizes = 1 / lines if falling else np.ones(len(lines))
    phases = seed.uniform(0, 2 * np.pi, len(lines))
    part = np.arange(round(PERIOD / period)) / round(PERIOD / period)
    wave = sizes @ np.cos(2 * np.pi * np.outer(lines, part) + phases[:, None])
    return wave / np.abs(wave).max()


def _repeated(wave: np.ndarray, rows: int) -> np.ndarray:
    return np.resize(wave, rows)


def _log_uniform(seed: np.random.Generator, band: tuple[float, float]) -> float:
    return float(np.exp(seed.uniform(*np.log(band))))
