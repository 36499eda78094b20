"""Operating points of many plants at once: Newton steps in lanes, from the nominal plant's own operating point."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..plant import Plant
from .operating_point import equilibrium, unknowns

_STEPS, _HALVINGS = 40, 6
_BLOCK = 500  # lanes at a time
_SMALL = 1e-9  # of each equation's largest slope: below it a rate has vanished


@dataclass(frozen=True)
class Equilibria:
    """States x [lanes, n] and inputs u [lanes, m] at which nothing changes but a position; ok [lanes]: found."""

    x: np.ndarray
    u: np.ndarray
    ok: np.ndarray


def equilibria(
    plant: Plant,
    p: np.ndarray,
    position: np.ndarray | float = 0.0,
    speed: float | None = None,
    command: float | None = None,
    **inputs: np.ndarray | float,
) -> Equilibria:
    """Operating points of plants with parameters p [lanes, k]: what `equilibrium` takes, `position` [m] and the inputs
    also [lanes].

    A lane without such a point is marked in `ok`. Raises InputError where the nominal plant has none at mid stroke,
    with the inputs that all lanes share.
    """
    shared = {name: float(value) for name, value in inputs.items() if np.ndim(value) == 0}
    nominal = equilibrium(plant, command, speed, p=None, **shared)
    w = np.tile(np.append(nominal.x, nominal.u), (len(p), 1))
    columns, balanced = unknowns(plant, command)
    if len(balanced) < plant.n:  # a jack
        _place(plant, w, position, command is None)
    _set_inputs(plant, w, inputs)
    return _solved(plant, p, w, columns, balanced)


def moved(
    plant: Plant, p: np.ndarray, points: Equilibria, position: np.ndarray | float, **inputs: np.ndarray | float
) -> Equilibria:
    """Operating points of the same plants and speeds at another `position` [m] ([lanes] or one), with other `inputs`.

    Newton steps start at `points`: few, for the position changes little but the chambers' volumes.
    """
    w = np.append(points.x, points.u, axis=1)
    _place(plant, w, position, True)
    _set_inputs(plant, w, inputs)
    return _solved(plant, p, w, *unknowns(plant, None))


def _place(plant: Plant, w: np.ndarray, position: np.ndarray | float, held: bool) -> None:
    """Write a position [m] into w = [x, u] [lanes, n + m], and, where it is to be `held`, the command that does."""
    x = plant.state("x")
    if held:
        w[:, plant.n] += plant.command_at(position) - plant.command_at(w[:, x])
    w[:, x] = position


def _set_inputs(plant: Plant, w: np.ndarray, inputs: Mapping[str, np.ndarray | float]) -> None:
    """Write inputs into w = [x, u] [lanes, n + m]."""
    for name, value in inputs.items():
        w[:, plant.n + plant.input(name)] = value


def _solved(plant: Plant, p: np.ndarray, w: np.ndarray, columns: list[int], balanced: list[int]) -> Equilibria:
    """Newton steps from w = [x, u], of which the unknown `columns` change in place; a block of lanes after the other,
    whose slopes are let go."""
    ok = [
        _balanced(plant, p[first : first + _BLOCK], w[first : first + _BLOCK], columns, balanced)
        for first in range(0, len(w), _BLOCK)
    ]
    return Equilibria(w[:, : plant.n], w[:, plant.n :], np.concatenate(ok) if ok else np.zeros(0, bool))


def _balanced(plant: Plant, p: np.ndarray, w: np.ndarray, columns: list[int], balanced: list[int]) -> np.ndarray:
    """Newton steps of some lanes, in place; which were found [lanes]."""
    scale = np.append(plant.scale, [i.scale for i in plant.inputs])[columns]
    balances = _Balances(plant, p, columns, balanced, scale)
    residual, slope = balances.linearised(w)
    rows = np.maximum(np.abs(slope * scale).max(axis=2), 1e-12)
    size = np.abs(residual / rows).max(axis=1)
    for _ in range(_STEPS):
        going = np.flatnonzero(size > _SMALL)
        if not going.size:
            break
        step = _newton(slope[going] * scale / rows[going, :, None], -(residual / rows)[going])
        balances.descend(w, rows, size, going, step)
        residual, slope = balances.linearised(w)
    return np.asarray(size <= 1e-7)


def _newton(slopes: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Newton steps [lanes, k], the smallest where slopes are singular: at rest bristles hold at any deflection.

    A lane whose slopes are not finite stays where it is.
    """
    try:
        return np.linalg.solve(slopes, rates[..., None])[..., 0]
    except np.linalg.LinAlgError:
        regular = np.linalg.cond(slopes) < 1 / np.finfo(float).eps
        singular = ~regular & np.isfinite(slopes).all(axis=(1, 2))
        steps = np.zeros_like(rates)
        steps[regular] = np.linalg.solve(slopes[regular], rates[regular, :, None])[..., 0]
        steps[singular] = (np.linalg.pinv(slopes[singular]) @ rates[singular, :, None])[..., 0]
        return steps


@dataclass(frozen=True)
class _Balances:
    """The square systems of lanes with parameters p [lanes, k]: unknown `columns` of w = [x, u], rates `balanced`."""

    plant: Plant
    p: np.ndarray
    columns: list[int]
    balanced: list[int]
    scale: np.ndarray

    def descend(self, w: np.ndarray, rows: np.ndarray, size: np.ndarray, going: np.ndarray, step: np.ndarray) -> None:
        """Move the lanes `going` along their steps, halved until the largest rate falls; the last half is taken as is.

        w [lanes, n + m] and `size` [lanes], the largest rate over its slope in `rows`, change in place.
        """
        share = 1.0
        for halving in range(_HALVINGS + 1):
            moved = w[going]
            moved[:, self.columns] += share * step * self.scale
            x, u = self._parts(moved)
            rates = np.array(self.plant.f(x.T, u.T, self.p[going].T)).T[:, self.balanced]
            trial = np.abs(rates / rows[going]).max(axis=1)
            better = (trial < size[going]) | (halving == _HALVINGS)
            w[going[better]], size[going[better]] = moved[better], trial[better]
            going, step = going[~better], step[~better]
            if not going.size:
                return
            share /= 2

    def linearised(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rates [lanes, balanced] and their slopes to the unknowns [lanes, balanced, columns]."""
        x, u = self._parts(w)
        rates = np.array(self.plant.f(x.T, u.T, self.p.T)).T[:, self.balanced]
        slope = np.concatenate(slopes(self.plant, x, u, self.p)[:2], axis=2)
        return rates, slope[:, self.balanced][:, :, self.columns]

    def _parts(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return w[:, : self.plant.n], w[:, self.plant.n :]


def slopes(plant: Plant, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, ...]:
    """df/dx [lanes, n, n], df/du [lanes, n, m], dh/dx [lanes, outputs, n], dh/du [lanes, outputs, m] of lanes."""
    lanes = len(x)
    parts = (np.array(part) for part in plant.slopes(x.T, u.T, p.T))
    return tuple(part.reshape(part.shape[0], lanes, -1).transpose(1, 0, 2) for part in parts)
