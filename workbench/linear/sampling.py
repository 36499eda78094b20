"""The plant as a sampled loop sees it: commands held over each period, a delay of theirs included, exact."""

from typing import TYPE_CHECKING

import numpy as np

from ..engine import periods
from .linearisation import jacobians
from .operating_point import Equilibrium
from .state_space import Matrices, StateSpace

if TYPE_CHECKING:
    import control

    from ..plant import Plant


def discretise(
    plant: "Plant",
    about: Equilibrium,
    period: float,
    outputs: tuple[str, ...] = ("position",),
    p: np.ndarray | None = None,
) -> "control.StateSpace":
    """x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k] about an operating point, in SI.

    u is the command, held over each period; where it is late, as in `held`, the commands on their way come after the
    plant's states.

    Parameters
    ----------
    plant
        A Plant, or a Rig, whose plant is built.
    about
        The operating point.
    period
        Time between samples [s].
    outputs
        Names of the signals of y.
    p
        Parameters [k] other than the plant's, as for `linearise`.

    Returns
    -------
    A python-control system with named states.

    Raises
    ------
    InputError
        For an unknown output.
    """
    model = sampled_plant(plant, about, period, outputs, p)
    way = [f"command {i + 1} ago" for i in range(len(model.A) - plant.n)]
    states = [state.name for state in plant.states]
    return model.to_control(states=states + way, name=f"{plant.name} sampled".replace(".", "_"))


def sampled_plant(
    plant: "Plant",
    about: Equilibrium,
    period: float,
    outputs: tuple[str, ...] = ("position",),
    p: np.ndarray | None = None,
) -> StateSpace:
    """What `discretise` gives, as the workbench's own linear system."""
    matrices = zero_order_hold(jacobians(plant, about, ("command",), outputs, p), plant.lateness(p), period)
    return StateSpace(*matrices, period, ["command"], list(outputs))


def zero_order_hold(matrices: Matrices, delay: float, period: float) -> Matrices:
    """A, B, C, D of a system, sampled every `period` [s] with its inputs held and `delay` [s] late.

    Where that is m + f periods, the system holds u[k - m - 1] over the first part f of a period and u[k - m] over the
    rest; the inputs on their way are states that follow the system's, the latest first (Franklin, Powell, Workman,
    Digital Control of Dynamic Systems, 3rd ed. 1998, ch. 4).
    """
    a, b, c, d = matrices
    whole, part = periods(delay, period)
    ahead, newer = hold_matrices(a, b, (1 - part) * period)
    taps = [np.zeros_like(b)] * whole + [newer]
    if part:
        before, older = hold_matrices(a, b, part * period)
        ahead, taps = ahead @ before, [*taps, ahead @ older]
    n, m = b.shape
    way = m * (len(taps) - 1)
    entering = np.eye(way, m)
    arriving = np.zeros((len(c), way + m))
    arriving[:, way:] = d
    return (
        np.block([[ahead, np.hstack([np.zeros((n, 0)), *taps[1:]])], [np.zeros((way, n)), np.eye(way, k=-m)]]),
        np.vstack((taps[0], entering)),
        np.hstack((c, arriving[:, m:])),
        arriving[:, :m],
    )


def hold_matrices(a: np.ndarray, b: np.ndarray, seconds: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What states become after `seconds`, a number or [.., 1, 1]: of themselves A [.., n, n], and of inputs held over
    them B [.., n, m]."""
    from scipy.linalg import expm

    n, m = b.shape[-2:]
    both = np.concatenate((a, b), axis=-1)
    both = expm(seconds * np.concatenate((both, np.zeros((*both.shape[:-2], m, n + m))), axis=-2))
    return both[..., :n, :n], both[..., :n, n:]
