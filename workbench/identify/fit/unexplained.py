"""Whether a fitted rig follows its records at all: where it does not, they are not of this rig, or misread."""

from collections.abc import Sequence

import numpy as np

from .model import Model
from .windows import Windows

_CLEAR = 10.0  # sigma: smaller errors are a matter for a trace, whatever the signal does
_LOST = 3.0  # error over the signal's own movement within a window: a wrong unit, sign or offset
_LEVEL = 0.05  # of a signal's own level: a smaller error may be a transducer's or a leak's, of one that hardly moves
_LOAD = 1.5  # the same of the force, which is all error where the load has a part that nobody described
_USELESS = 0.7  # hardly better than a constant in each window; if half of the signals are, the rig is another one


def unexplained_signals(model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray) -> list[str]:
    """The signals that say so, worst first; none where the rig is at least of the kind that was recorded.

    A supply pressure that the model holds constant has an error as large as its movement, and is no such signal alone.
    """
    errors = model.errors(windows, x0, p)
    shares = {name: _shares(windows, errors, column) for column, name in enumerate(windows.names)}
    level = {name: _LOAD if name == "force" else _LEVEL for name in shares}
    share = {name: of_movement if of_level > level[name] else 0.0 for name, (of_movement, of_level) in shares.items()}
    lost = [name for name, ratio in share.items() if ratio > _LOST]
    useless = [name for name, ratio in share.items() if ratio > _USELESS]
    unexplained = lost or (useless if 2 * len(useless) > len(share) else [])
    return sorted(unexplained, key=lambda name: -share[name])


def _shares(windows: Windows, errors: Sequence[np.ndarray], column: int) -> tuple[float, float]:
    """Error of a signal over its own movement within the windows, and over its level; 0 where the error is small."""
    wrong, moved, level, count = 0.0, 0.0, 0.0, 0
    for group, error in zip(windows.groups, errors, strict=True):
        valid, weight = group.weight[..., column] > 0, group.weight[..., column]
        measured = group.measured[..., column]
        mean = np.sum(measured * valid, axis=1) / np.maximum(valid.sum(axis=1), 1)
        moved += float(np.sum(((measured - mean[:, None]) * weight) ** 2))
        level += float(np.sum((mean[:, None] * weight) ** 2))
        wrong += float(np.sum(error[..., column] ** 2))
        count += int(valid.sum())
    if wrong <= _CLEAR**2 * count:
        return 0.0, 0.0
    return float(np.sqrt(wrong / max(moved, 1e-300))), float(np.sqrt(wrong / max(level, 1e-300)))
