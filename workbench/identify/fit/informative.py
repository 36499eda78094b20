"""Which windows tell most of a rig's numbers: D-optimal, with a part of every kind of motion in them.

The information of window w on the numbers is A_w, initial states following (see normal_equations.py). Windows are taken
one by one, each the one that most raises log det(P + sum A_w), P the prior of the numbers' ranges (Fedorov, Theory of
Optimal Experiments, 1972). Numbers that nobody has asked for yet, those of a missing effect, may show elsewhere: so
half of the windows are shared out between kinds of motion first, one command and one direction each.
"""

from collections.abc import Sequence

import numpy as np

from ..data.noise_floor import same_command
from .determined import FreeParameter
from .initial_states import fit_states
from .model import Model
from .normal_equations import normal_equations, ranges
from .windows import Windows

_SHARED = 0.5  # of the windows: shared out between kinds of motion
_STANDING = 0.05  # of the largest travel in a window: less is standing
_ROUNDS = 2  # of initial states: their slopes are what counts


def informative(model: Model, windows: Windows, free: Sequence[FreeParameter], most: int) -> list[int]:
    """The numbers, in order, of at most `most` windows; all where there are no more."""
    if windows.count <= most:
        return list(range(windows.count))
    p = model.p
    guess = model.starts(windows, p)
    x0, _ = fit_states(model, windows, guess, p, _ROUNDS)
    normal = normal_equations(model, windows, x0, p, guess, free, np.zeros(len(free)))
    matrices = normal.reduced()[0]
    _, _, width = ranges(free)
    return _d_optimal(matrices, np.diag(width**-2), kinds(windows), most)


def kinds(windows: Windows) -> np.ndarray:
    """The kind of motion [w] of each window: whose command it has, and whether it goes out, back or stands."""
    command: list[int] = []
    for i, record in enumerate(windows.records):
        command.append(next((k for k in range(i) if same_command(windows.records[k], record)), i))
    travel = np.array([_travel(windows, w) for w in range(windows.count)])
    direction = np.sign(travel) * (np.abs(travel) > _STANDING * np.abs(travel).max())
    return np.array([3 * command[i] for i, *_ in windows.spans]) + direction.astype(int)


def _travel(windows: Windows, w: int) -> float:
    """How far a window goes: by the position, or by the command where that was not recorded."""
    index, first, end = windows.spans[w]
    signals = windows.records[index].signals
    if "position" in signals:
        return float(signals["position"][end - 1] - signals["position"][first])
    return float(np.mean(signals["command"][first:end]))


def _d_optimal(matrices: np.ndarray, prior: np.ndarray, kinds: np.ndarray, most: int) -> list[int]:
    _, kind = np.unique(kinds, return_inverse=True)
    left, total, taken = np.ones(len(matrices), bool), prior.copy(), np.zeros(kind.max() + 1, int)
    shared = int(_SHARED * most)
    share = max(1, shared // len(taken))
    for place in range(most):
        owed = left & (taken < share)[kind]
        able = np.flatnonzero(owed if place < shared and owed.any() else left)
        best = able[np.argmax(np.linalg.slogdet(total + matrices[able])[1])]
        left[best], total = False, total + matrices[best]
        taken[kind[best]] += 1
    return np.flatnonzero(~left).tolist()
