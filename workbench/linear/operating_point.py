"""Operating points: at rest, at constant command, and moving at constant speed."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..base.errors import InputError, nearest
from ..rigs.line_valve import SPRINGS
from ..rigs.oil import ATMOSPHERE

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

    from ..plant import Plant


_BALANCED = 1e-7  # of each equation's largest slope: below it a rate has vanished
_OPEN = 0.3  # command at which a pump's direction valves are open
_HALVINGS = 6  # of a speed that a drive does not give
_ON_THE_WAY = 16  # steps from rest to a point that no search reaches at once
_SETTLING = 10.0  # s: longer than any but a leak takes
_SOFTER = 1.6 ** np.arange(15, -1, -1)  # times the pressure over which a line valve opens
_FIRST_STEP, _LAST_STEP, _GROWTH = 1e-5, 1e4, 1.1  # s, s, and from one to the next, of implicit steps in time

T = TypeVar("T", float, np.ndarray)


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

    A pump drive rests on the command that just opens a direction valve against the low side's pressure. At a command it
    is where it comes to in time: a load that slips as it moves holds any force at rest.

    Parameters
    ----------
    plant
        A Plant, or a Rig, whose plant is built.
    command
        Command [1] at which the jack's speed is found; the only input of a valve bench.
    speed
        Speed [m/s] of a jack whose command is found; 0 where neither is given.
    position
        Position [m] from mid stroke at which a jack is held.
    p
        Parameters [k] other than the plant's.
    **inputs
        Other inputs by name, SI.

    Returns
    -------
    States, inputs and speed there.

    Raises
    ------
    InputError
        Where there is no such point, with what is left over.
    """
    p = plant.p if p is None else p
    if command is not None and speed is not None:
        raise InputError(f"{plant.name}: give a speed or a command, not both: each decides the other")
    known = [i.name for i in plant.inputs]
    for name in inputs:
        if name not in known:
            raise InputError(f'{plant.name}: no input "{name}"; {nearest(name, known)}')
    columns, balanced = unknowns(plant, command)
    base = np.append(plant.start, [inputs.get(i.name, 0.0) for i in plant.inputs])
    base[plant.n] = command or 0.0
    jack = len(balanced) < plant.n
    if jack:
        base[plant.state("x")] = position
    if plant.n in columns:
        base[plant.n] = plant.command_at(position)
        base[plant.state("v")] = speed or 0.0
    solve = Balance(plant, p, base, columns, balanced)
    if any(state.parted for state in plant.states):
        best = solve.relaxed(np.zeros(len(columns)))
        if solve.misses(best):
            best = solve.with_springs_that_stiffen(Balance.relaxed)
    elif columns == balanced and any(state.held for state in plant.states):
        best = solve.settled()
    else:
        best = min((solve.search(start) for start in solve.starts()), key=lambda solution: solution.cost)
    if solve.misses(best):
        best = solve.followed_from_rest()
    if solve.misses(best):
        best = min((solve.search(start, full=True) for start in solve.starts()), key=lambda solution: solution.cost)
    residual = solve.residual(best.x)
    worst = int(np.argmax(np.abs(residual)))
    if abs(residual[worst]) > _BALANCED:
        name = plant.states[balanced[worst]].name
        raise InputError(f"{plant.name}: no equilibrium there, {name}' cannot be brought to zero; ask for less")
    x, u = solve.unpack(best.x)
    return Equilibrium(x, u, float(x[plant.state("v")]) if jack else 0.0)


def moving_point(
    plant: "Plant", speed: float, position: float = 0.0, p: np.ndarray | None = None
) -> tuple[Equilibrium, float]:
    """The operating point at a speed [m/s], a specimen's far end moving along, and that speed: where a drive does not
    give it, the first of its halves that it gives. Raises InputError as `equilibrium`."""

    def at(speed: float) -> Equilibrium:
        return equilibrium(plant, None, speed, position, p, **far_end(plant, position, speed))

    for slower in speed / 2.0 ** np.arange(_HALVINGS):
        try:
            return at(float(slower)), float(slower)
        except InputError:
            continue
    return at(speed), speed


def far_end(plant: "Plant", position: T, velocity: T | float = 0.0) -> dict[str, T | float]:
    """The inputs that hold a specimen's far end at a position [m], or move it along; none where it has no far end."""
    inputs = {"specimen_position": position, "specimen_velocity": velocity}
    known = [i.name for i in plant.inputs]
    return {name: value for name, value in inputs.items() if name in known}


def unknowns(plant: "Plant", command: float | None) -> tuple[list[int], list[int]]:
    """Columns of [x, u] that an operating point leaves open, and the states whose rates must vanish.

    A jack's position is held; its command is open where none is given, and its speed where one is.
    """
    names = [state.name for state in plant.states]
    balanced = [i for i, state in enumerate(plant.states) if state.name != "x" and not state.held]
    if "x" not in names or command is not None:
        return balanced, balanced
    return [*(i for i in balanced if names[i] != "v"), plant.n], balanced


class Balance:
    """The square system of an operating point, in scaled unknowns: `columns` of [x, u], from `base` [n + m] on."""

    def __init__(
        self, plant: "Plant", p: np.ndarray, base: np.ndarray, columns: list[int], balanced: list[int]
    ) -> None:
        import casadi as ca  # 0.5 s, which reading an experiment need not wait for

        from ..engine.buffered import BufferedFunction

        self.plant, self.base, self.columns, self.balanced, self._p = plant, base, columns, balanced, p
        x, v = ca.SX.sym("x", plant.n), ca.SX.sym("u", len(plant.inputs))
        rates = plant.f(x, v, ca.DM(p))
        slopes = ca.horzcat(ca.jacobian(rates, x), ca.jacobian(rates, v))
        self._rates, self._slopes = (
            BufferedFunction(ca.Function(name, [x, v], [ca.densify(each)]))
            for name, each in (("rates", rates), ("slopes", slopes))
        )
        self.scale = np.append(plant.scale, [i.scale for i in plant.inputs])[columns]
        rows, away = (
            np.abs(self._jacobian_si(z) * self.scale).max(axis=1) for z in (np.zeros(len(columns)), self._apart())
        )
        self.rows = np.maximum(np.where(rows > 0, rows, away), 1e-12)  # a play has no slope inside its gap

    def unpack(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Full state and input from scaled unknowns."""
        w = self.base.copy()
        w[self.columns] += z * self.scale
        return w[: self.plant.n], w[self.plant.n :]

    def residual(self, z: np.ndarray) -> np.ndarray:
        """Rates that must vanish, each over the largest slope of its own equation."""
        return self._rates_si(z) / self.rows

    def _rates_si(self, z: np.ndarray) -> np.ndarray:
        return self._rates(*self.unpack(z))[self.balanced]

    def _apart(self) -> np.ndarray:
        """Scaled unknowns that all differ: no play is inside its gap there."""
        return 1.0 + np.arange(len(self.columns)) / len(self.columns)

    @property
    def slope(self) -> Any:
        """Jacobian of `residual`, a function of scaled unknowns (Any: scipy's stubs know no callable there)."""
        return lambda z: self._jacobian_si(z) * self.scale / self.rows[:, None]

    def _jacobian_si(self, z: np.ndarray) -> np.ndarray:
        slopes = self._slopes(*self.unpack(z)).reshape((self.plant.n, -1), order="F")
        return slopes[np.ix_(self.balanced, self.columns)]

    def starts(self) -> list[np.ndarray]:
        """The points that searches start at: an open command on and beside null, around which the lap makes its slope
        jump."""
        start = np.zeros(len(self.columns))
        if self.plant.n not in self.columns:
            return [start]
        command = np.arange(len(start)) == self.columns.index(self.plant.n)
        if any(state.held for state in self.plant.states):  # shut, its direction valves hold a jack at any pressures
            return [self._with_open_valves(level) for level in (_OPEN, -_OPEN)]
        return [start + command * level for level in (0.0, 0.02, -0.02)]

    def _with_open_valves(self, command: float) -> np.ndarray:
        """Scaled unknowns of the point at a command, whose direction valves are open: from there the slopes lead on."""
        given = self.base.copy()
        given[self.plant.n] = command
        at_command = Balance(self.plant, self._p, given, self.balanced, self.balanced)
        x, u = at_command.unpack(at_command.search(np.zeros(len(self.balanced))).x)
        return (np.append(x, u) - self.base)[self.columns] / self.scale

    def followed_from_rest(self) -> "OptimizeResult":
        """The last of searches in which what is given of speed and inputs grows from 0, each from where the last ended.

        For points that a search from far away misses: at low pressure soft oil makes every rate small.
        """
        whole, solution = self.base, self.search(self.starts()[0])
        moves = np.array([state.name == "v" for state in self.plant.states] + [True] * len(self.plant.inputs))
        for share in np.arange(_ON_THE_WAY + 1) / _ON_THE_WAY:
            self.base = np.where(moves, share * whole, whole)
            solution = self.search(solution.x)
        return solution

    def misses(self, solution: "OptimizeResult") -> bool:
        """Whether a search ended where something still changes."""
        return float(np.abs(self.residual(solution.x)).max()) > _BALANCED

    def settled(self) -> "OptimizeResult":
        """A search from where the states come to in time, the jack moving but held at its position. Needs every rate's
        state to be unknown."""
        from scipy.integrate import solve_ivp

        def rates(_: float, z: np.ndarray) -> np.ndarray:
            return self._rates_si(z) / self.scale

        def slopes(_: float, z: np.ndarray) -> np.ndarray:
            return self._jacobian_si(z) * self.scale / self.scale[:, None]

        run = solve_ivp(rates, (0.0, _SETTLING), np.zeros(len(self.columns)), "Radau", jac=slopes)
        return self.search(run.y[:, -1])

    @property
    def springs(self) -> list[int]:
        """Places of the parameters that are the pressures over which line valves open."""
        return [i for i, name in enumerate(self.plant.parameters) if name.rpartition(".")[2] in SPRINGS]

    def with_springs_that_stiffen(self, search: "Callable[[Balance, np.ndarray], OptimizeResult]") -> "OptimizeResult":
        """The last of searches, each from where the last ended, with line valves that open over ever less pressure,
        down to their own."""
        z = np.zeros(len(self.columns))
        for softer in _SOFTER:
            p = self._p.copy()
            p[self.springs] *= softer
            z = search(Balance(self.plant, p, self.base, self.columns, self.balanced), z).x
        return self.search(z)

    def relaxed(self, start: np.ndarray) -> "OptimizeResult":
        """A search from where linearly implicit Euler steps in time lead, which grow and so damp what never settles, as
        a check valve hunts that a pilot lifts under a load that overruns. Behind a valve that is shut, slopes alone
        lead nowhere. A command that is unknown falls as the jack, whose speed is held then, would gain speed.
        """
        n, v = self.plant.n, self.balanced.index(self.plant.state("v"))
        rows = [v if column == n else self.balanced.index(column) for column in self.columns]
        sizes = np.where(np.array(self.columns) == n, -self.plant.scale[self.balanced[v]], self.scale)
        z, step, own = start, _FIRST_STEP, np.eye(len(rows))
        while step < _LAST_STEP:
            motion = self._rates_si(z)[rows] / sizes
            slopes = self._jacobian_si(z)[rows] * self.scale / sizes[:, None]
            z = z + np.linalg.solve(own / step - slopes, motion)
            step *= _GROWTH
        return self.search(z)

    def search(self, start: np.ndarray, full: bool = False) -> "OptimizeResult":
        """A damped Gauss-Newton search from these scaled unknowns; `full`: without gas in chambers, from where
        nothing leads back."""
        from scipy.optimize import least_squares

        units = [each.unit for each in (*self.plant.states, *self.plant.inputs)]
        chambers = full & (np.array(units)[self.columns] == "Pa")
        low = np.where(chambers, -(ATMOSPHERE + self.base[self.columns]) / self.scale, -np.inf)
        return least_squares(
            self.residual,
            np.maximum(start, low),
            self.slope,
            (low, np.inf),
            "trf",
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=300,
        )
