"""Views of a platform's plant: equilibrium under gravity in any pose, modes with shapes, directions that decouple."""

from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..plant import Plant
from ..rigs.platform import AXES, Platform
from .operating_point import Balance, Equilibrium

LEGS = 6
_BALANCED = 1e-7  # of each equation's largest slope
_ALIKE = 1e-3  # of a frequency: modes nearer than that are a pair


def platform_equilibrium(
    plant: Plant, pose: np.ndarray | None = None, p: np.ndarray | None = None, **wrench: float
) -> Equilibrium:
    """The commands and states that hold a platform's plant in a pose [6] (home) under gravity, and under a wrench on it
    by the names of its inputs, SI.

    Raises InputError where the jacks cannot hold it, naming the rate that is left over.
    """
    names = [state.name for state in plant.states]
    own = [i for i, name in enumerate(names) if name.startswith("leg")]
    first = names.index(AXES[0])
    base = np.append(plant.start, np.zeros(len(plant.inputs)))
    base[first : first + LEGS] = 0.0 if pose is None else pose
    for name, value in wrench.items():
        base[plant.n + plant.input(name)] = value
    columns = [*own, *(plant.n + i for i in range(LEGS))]
    balanced = [*own, *range(first + LEGS, first + 2 * LEGS)]
    balance = Balance(plant, plant.p if p is None else p, base, columns, balanced)
    solution = balance.search(np.zeros(len(columns)))
    if balance.springs and balance.misses(solution):
        solution = balance.with_springs_that_stiffen(Balance.search)
    residual = np.abs(balance.residual(solution.x))
    if residual.max() > _BALANCED:
        name = names[balanced[int(np.argmax(residual))]]
        raise InputError(f"{plant.name}: no equilibrium there, {name}' cannot be brought to zero; ask for less")
    return Equilibrium(*balance.unpack(solution.x), 0.0)


@dataclass(frozen=True)
class PlatformMode:
    """A mode: natural frequency [Hz], damping ratio, and its shape [6]: how far it moves along the axes of the pose,
    angles times the radius of the joints, the largest 1."""

    hz: float
    zeta: float
    shape: np.ndarray


def platform_modes(
    platform: Platform, plant: Plant, about: Equilibrium, p: np.ndarray | None = None
) -> list[PlatformMode]:
    """The six modes of the platform on its oil, slowest first, of the plant linearised about an operating point.

    Of two modes alike any mix is one, too: they are turned until the first does not move along the axis along which the
    second moves most.
    """
    a = np.array(plant.slopes(about.x, about.u, plant.p if p is None else p)[0])
    values, right = np.linalg.eig(a)
    first = plant.state(AXES[0])
    speeds = slice(first + LEGS, first + 2 * LEGS)
    share = np.abs(np.linalg.inv(right)[:, speeds] * right[speeds].T).sum(axis=1)
    share[np.imag(values) <= 0] = -1.0
    chosen = sorted(np.argsort(share)[-LEGS:], key=lambda i: abs(values[i]))
    weights = platform.geometry.weights
    shapes = np.array([_real(right[first : first + LEGS, i] * weights) for i in chosen])
    poles = values[chosen]
    return [
        PlatformMode(float(abs(pole) / (2 * np.pi)), float(-pole.real / abs(pole)), shape)
        for pole, shape in zip(poles, _parted(np.abs(poles), shapes), strict=True)
    ]


def _real(shape: np.ndarray) -> np.ndarray:
    """With its largest part real and 1."""
    return np.real(shape / shape[np.argmax(np.abs(shape))])


def _parted(frequencies: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Pairs of equal frequencies turned apart."""
    shapes = shapes.copy()
    for i in range(LEGS - 1):
        if frequencies[i + 1] - frequencies[i] < _ALIKE * frequencies[i]:
            pair = shapes[i : i + 2]
            axes = np.argsort(np.linalg.norm(pair, axis=0))[::-1]
            most = sorted(axes[:2])
            shapes[i : i + 2] = [_real(np.array(turn) @ pair) for turn in _apart(pair[:, most])]
    return shapes


def _apart(pair: np.ndarray) -> tuple[tuple[float, float], tuple[float, float]]:
    """Combinations of two rows [2, 2] without the second, and without the first axis."""
    return (pair[1, 1], -pair[0, 1]), (pair[1, 0], -pair[0, 0])


def decoupling(plant: Plant, about: Equilibrium, p: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Directions U [6, 6] of leg space along which the platform is six jacks of one mass each, and these masses [6],
    kg, largest first (so slowest): the eigenvectors of the accelerations of the legs per force on them."""
    p = plant.p if p is None else p
    slopes = np.array(plant.slopes(about.x, about.u, p)[2])
    rows = [plant.output(f"leg{i + 1}.acceleration") for i in range(LEGS)]
    forces = [plant.output(f"leg{i + 1}.jack_force") for i in range(LEGS)]
    columns = [plant.state(f"leg{i + 1}.P1") for i in range(LEGS)]
    mobility = slopes[np.ix_(rows, columns)] / np.diag(slopes[np.ix_(forces, columns)])
    values, directions = np.linalg.eigh((mobility + mobility.T) / 2)
    return directions, 1 / values
