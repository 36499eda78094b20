"""Operating points: at rest, at constant command, and moving at constant speed."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import InputError, nearest

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

    from ..plant import Plant


@dataclass(frozen=True)
class Equilibrium:
    """State x [n] and input u [m] at which nothing changes but, for a moving jack, the position."""

    x: np.ndarray
    u: np.ndarray
    speed: float


def equilibrium(
    plant: "Plant",
    command: float | None = None,
    speed: float | None = None,
    position: float = 0.0,
    p: np.ndarray | None = None,
    **inputs: float,
) -> Equilibrium:
    """The operating point of a plant, all numbers SI.

    A jack is held at `position` from mid stroke: give its `speed` [m/s] (0 when neither is given) and the command is
    found, or a `command` and the speed is found. A valve bench takes `command`, its only input. Other inputs by name.
    Raises InputError when there is no such point, naming what is left over.
    """
    p = plant.p if p is None else p
    if command is not None and speed is not None:
        raise InputError(f"{plant.name}: give a speed or a command, not both: each decides the other")
    known = [i.name for i in plant.inputs]
    for name in inputs:
        if name not in known:
            raise InputError(f'{plant.name}: no input "{name}"; {nearest(name, known)}')
    names = [state.name for state in plant.states]
    jack = "x" in names
    free_command = jack and command is None
    u = np.array([inputs.get(i.name, 0.0) for i in plant.inputs])
    u[0] = command or 0.0
    held = {"x": position} if jack else {}
    if free_command:
        held["v"] = speed or 0.0
    free = [i for i, name in enumerate(names) if name not in held]
    solve = _Balance(plant, p, u, held, free, free_command)
    best = min((solve.search(scale) for scale in (0.0, 0.02, -0.02)), key=lambda solution: solution.cost)
    residual = solve.residual(best.x)
    worst = int(np.argmax(np.abs(residual)))
    if abs(residual[worst]) > 1e-7:
        name = plant.states[solve.balanced[worst]].name
        raise InputError(f"{plant.name}: no equilibrium there, {name}' cannot be brought to zero; ask for less")
    x, u = solve.unpack(best.x)
    return Equilibrium(x, u, float(x[names.index("v")]) if jack else 0.0)


class _Balance:
    """The square system of an operating point, in scaled unknowns."""

    def __init__(
        self, plant: "Plant", p: np.ndarray, u: np.ndarray, held: dict[str, float], free: list[int], free_command: bool
    ) -> None:
        import casadi as ca  # 0.5 s, which reading an experiment need not wait for

        self.plant, self.p, self.u, self.free, self.free_command = plant, p, u, free, free_command
        self.base = plant.start
        for name, value in held.items():
            self.base[plant.state(name)] = value
        self.balanced = [i for i, state in enumerate(plant.states) if state.name != "x"]
        x, v = ca.SX.sym("x", plant.n), ca.SX.sym("u", len(plant.inputs))
        rates = plant.f(x, v, ca.DM(p))
        slopes = ca.horzcat(ca.jacobian(rates, x), ca.jacobian(rates, v))
        self._rates = ca.Function("rates", [x, v], [rates])
        self._slopes = ca.Function("slopes", [x, v], [slopes])
        columns = [*free, *([plant.n] if free_command else [])]
        self.scale = np.append(plant.scale, [i.scale for i in plant.inputs])[columns]
        rows = np.abs(self._jacobian_si(np.zeros(len(columns))) * self.scale).max(axis=1)
        self.rows = np.maximum(rows, 1e-12)

    def unpack(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Full state and input from scaled unknowns."""
        x, u = self.base.copy(), self.u.copy()
        x[self.free] += z[: len(self.free)] * self.scale[: len(self.free)]
        if self.free_command:
            u[0] = z[-1] * self.scale[-1]
        return x, u

    def residual(self, z: np.ndarray) -> np.ndarray:
        """Rates that must vanish, each over the largest slope of its own equation."""
        return np.array(self._rates(*self.unpack(z))).ravel()[self.balanced] / self.rows

    @property
    def slope(self) -> Any:
        """Jacobian of `residual`, a function of scaled unknowns (Any: scipy's stubs know no callable there)."""
        return lambda z: self._jacobian_si(z) * self.scale / self.rows[:, None]

    def _jacobian_si(self, z: np.ndarray) -> np.ndarray:
        columns = [*self.free, *([self.plant.n] if self.free_command else [])]
        return np.array(self._slopes(*self.unpack(z)))[np.ix_(self.balanced, columns)]

    def search(self, command: float) -> "OptimizeResult":
        """A damped Gauss-Newton search that starts with this command."""
        from scipy.optimize import least_squares

        start = np.zeros(len(self.scale))
        if self.free_command:
            start[-1] = command

        return least_squares(
            self.residual, start, self.slope, method="trf", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=300
        )
