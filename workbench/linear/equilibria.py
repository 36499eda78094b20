"""Operating points of many plants at once: Newton steps in lanes, from the nominal plant's own operating point."""

from dataclasses import dataclass

import numpy as np

from ..plant import Plant
from .operating_point import equilibrium

_STEPS, _HALVINGS = 40, 6
_SMALL = 1e-9  # of each equation's largest slope: below it a rate has vanished


@dataclass(frozen=True)
class Equilibria:
    """States x [lanes, n] and inputs u [lanes, m] at which nothing changes but the position; ok [lanes]: found."""

    x: np.ndarray
    u: np.ndarray
    ok: np.ndarray


def equilibria(
    plant: Plant, p: np.ndarray, position: np.ndarray | float = 0.0, speed: float = 0.0, **inputs: float
) -> Equilibria:
    """Operating points of plants with parameters p [lanes, k] at `position` [m] ([lanes] or one), at one `speed` [m/s].

    Other inputs by name. A lane without such a point is marked in `ok`. Raises InputError where the nominal plant has
    none at mid stroke.
    """
    lanes = len(p)
    nominal = equilibrium(plant, speed=speed, p=None, **inputs)
    x, u = np.tile(nominal.x, (lanes, 1)), np.tile(nominal.u, (lanes, 1))
    x[:, plant.state("x")] = position
    return _balanced(plant, p, x, u)


def moved(plant: Plant, p: np.ndarray, points: Equilibria, position: np.ndarray | float) -> Equilibria:
    """Operating points of the same plants, speeds and inputs at another `position` [m] ([lanes] or one).

    Newton steps start at `points`: few, for the position changes little but the chambers' volumes.
    """
    x = points.x.copy()
    x[:, plant.state("x")] = position
    return _balanced(plant, p, x, points.u.copy())


def _balanced(plant: Plant, p: np.ndarray, x: np.ndarray, u: np.ndarray) -> Equilibria:
    """Newton steps from x and u, which change in place; position, speed and other inputs stay."""
    place = plant.state("x")
    free = [i for i, state in enumerate(plant.states) if state.name not in ("x", "v")]
    balanced = [i for i in range(plant.n) if i != place]
    scale = np.append(plant.scale[free], plant.inputs[0].scale)
    residual, slope = _linearised(plant, p, x, u, free, balanced)
    rows = np.maximum(np.abs(slope * scale).max(axis=2), 1e-12)
    size = np.abs(residual / rows).max(axis=1)
    for _ in range(_STEPS):
        going = np.flatnonzero(size > _SMALL)
        if not going.size:
            break
        step = np.linalg.solve(slope[going] * scale / rows[going, :, None], -(residual / rows)[going, :, None])[..., 0]
        _descend(plant, p, x, u, free, balanced, rows, scale, size, going, step)
        residual, slope = _linearised(plant, p, x, u, free, balanced)
    return Equilibria(x, u, size <= 1e-7)


def _descend(
    plant: Plant,
    p: np.ndarray,
    x: np.ndarray,
    u: np.ndarray,
    free: list[int],
    balanced: list[int],
    rows: np.ndarray,
    scale: np.ndarray,
    size: np.ndarray,
    going: np.ndarray,
    step: np.ndarray,
) -> None:
    """Move the lanes `going` along their steps, halved until the largest rate falls; the last half is taken as is."""
    share = 1.0
    for halving in range(_HALVINGS + 1):
        trial_x, trial_u = x[going], u[going]
        trial_x[:, free] += share * step[:, :-1] * scale[:-1]
        trial_u[:, 0] += share * step[:, -1] * scale[-1]
        rates = np.array(plant.f(trial_x.T, trial_u.T, p[going].T)).T[:, balanced]
        trial = np.abs(rates / rows[going]).max(axis=1)
        better = (trial < size[going]) | (halving == _HALVINGS)
        moved = going[better]
        x[moved], u[moved], size[moved] = trial_x[better], trial_u[better], trial[better]
        going, step = going[~better], step[~better]
        if not going.size:
            return
        share /= 2


def _linearised(
    plant: Plant, p: np.ndarray, x: np.ndarray, u: np.ndarray, free: list[int], balanced: list[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Rates [lanes, balanced] and their slopes to the free states and the command [lanes, balanced, free + 1]."""
    rates = np.array(plant.f(x.T, u.T, p.T)).T[:, balanced]
    a, b = slopes(plant, x, u, p)[:2]
    return rates, np.concatenate((a[:, balanced][:, :, free], b[:, balanced, :1]), axis=2)


def slopes(plant: Plant, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, ...]:
    """df/dx [lanes, n, n], df/du [lanes, n, m], dh/dx [lanes, outputs, n], dh/du [lanes, outputs, m] of lanes."""
    lanes = len(x)
    parts = (np.array(part) for part in plant.slopes(x.T, u.T, p.T))
    return tuple(part.reshape(part.shape[0], lanes, -1).transpose(1, 0, 2) for part in parts)
