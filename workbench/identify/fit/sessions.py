"""Do groups of records differ in a number of the rig? A score test on a fit that has them alike.

Records that were made on another day, or later in the day, may be of another state of one rig: warmer oil, another
supply. About the fit the squared errors of window w go as V_w + 2 g_w'd + d'A_w d. Let number j be d_j + s in the
windows of a group only; with the other numbers following, the errors fall by g~^2/A~ at s = -g~/A~, where

    A~ = a_jj - a_j' A^-1 a_j,   g~ = g_j - a_j' A^-1 g,   a = sum over the group of A_w, g_j of its gradients,

A and g over all windows and the prior (Rao's score test; no further fit is made).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...records import Record
from ..data.noise_floor import same_command
from .normal_equations import ranges
from .solver import Fit
from .windows import Windows

CLEAR = 30.0  # of noise that is coloured and of the misfit: fall of the squared errors that no chance makes
LATER = "later repeats"
_OWN = 1e-6  # of a number's information in a group: less, and the group has that number to itself already
_MATTERS, _ODD = 0.5, 50.0  # %: less is no matter, more is no other state of one rig


@dataclass(frozen=True)
class SessionDifference:
    """A number of the rig that is `percent` larger, +- `error` at 95 %, in a group of records than in the others."""

    number: str
    group: str
    records: tuple[str, ...]
    percent: float
    error: float
    gain: float


def groups(records: Sequence[Record]) -> dict[str, tuple[int, ...]]:
    """Groups of records [places] that may be of another session: by the signals that they carry, and later repeats."""
    found: dict[str, tuple[int, ...]] = {}
    carried = [tuple(name for name in record.names if name != "command") for record in records]
    for names in dict.fromkeys(carried):
        alone = [name for name in names if any(name not in other for other in carried)]
        if alone:
            found[f"with {', '.join(alone)}"] = tuple(i for i, own in enumerate(carried) if own == names)
    later: list[int] = []
    for i, record in enumerate(records):
        alike = [k for k, other in enumerate(records) if carried[k] == carried[i] and same_command(other, record)]
        if alike.index(i) >= (len(alike) + 1) // 2:
            later.append(i)
    return found | ({LATER: tuple(later)} if later else {})


def session_differences(
    fit: Fit, windows: Windows, sessions: Mapping[str, Sequence[int]], kappa: float
) -> list[SessionDifference]:
    """The clearest difference of each group of records [places], most first; none where chance may have made it.

    The errors of the fit count as noise: under a model that lacks something groups differ in many ways.
    """
    if not fit.ok or not fit.free:
        return []
    _, _, width = ranges(fit.free)
    matrix = fit.matrices.sum(axis=0) + np.diag(width**-2)
    gradient = fit.gradients.sum(axis=0) + fit.x / width**2
    noise = kappa * fit.louder
    index = np.array([record for record, *_ in windows.spans])
    clear = []
    for name, places in sessions.items():
        own = np.isin(index, places)
        if own.all() or not own.any():
            continue
        within = fit.matrices[own].sum(axis=0)
        solved = np.linalg.solve(matrix, np.column_stack((within, gradient)))
        information = np.diag(within) - np.einsum("ij,ij->j", within, solved[:, :-1])
        score = fit.gradients[own].sum(axis=0) - within @ solved[:, -1]
        information = np.maximum(information, 1e-12)
        shift, gain = -score / information, score**2 / information
        steps = np.array([_relative(fit, k) for k in range(len(fit.free))])
        percent, error = 100 * shift * steps, 196 * np.sqrt(noise / information) * np.abs(steps)
        plausible = (np.abs(percent) > _MATTERS) & (np.abs(percent) < _ODD) & (information > _OWN * np.diag(within))
        best = int(np.argmax(np.where(plausible, gain, 0.0)))
        if plausible[best] and gain[best] > CLEAR * noise:
            who = tuple(windows.records[i].name for i in places)
            clear.append(
                SessionDifference(
                    fit.free[best].name, name, who, float(percent[best]), float(error[best]), float(gain[best])
                )
            )
    return sorted(clear, key=lambda each: -each.gain)


def _relative(fit: Fit, k: int) -> float:
    """Relative change of a number per distance; 0 for one that is 0."""
    free, value = fit.free[k], fit.free[k].value(float(fit.x[k]))
    if free.scale is None:
        return 1.0
    return free.scale / value if value else 0.0
