"""Whether a fitted rig follows its records at all: where it does not, they are not of this rig, or misread."""

from collections.abc import Sequence

import numpy as np

from .model import Model
from .windows import Windows

_CLEAR = 10.0  # sigma: smaller errors are a matter for a trace, whatever the signal does
_LOST = 3.0  # error over the signal's own movement within a window: a wrong unit, sign or offset
_USELESS = 0.7  # hardly better than a constant in each window; if half of the signals are, the rig is another one


def unexplained_signals(model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray) -> list[str]:
    """The signals that say so, worst first; none where the rig is at least of the kind that was recorded.

    A supply pressure that the model holds constant has an error as large as its movement, and is no such signal alone.
    """
    errors = model.errors(windows, x0, p)
    share = {name: _share(windows, errors, column) for column, name in enumerate(windows.names)}
    lost = [name for name, ratio in share.items() if ratio > _LOST]
    useless = [name for name, ratio in share.items() if ratio > _USELESS]
    unexplained = lost or (useless if 2 * len(useless) > len(share) else [])
    return sorted(unexplained, key=lambda name: -share[name])


def _share(windows: Windows, errors: Sequence[np.ndarray], column: int) -> float:
    """Error of a signal over its own movement within the windows; 0 where the error is small."""
    wrong, moved, count = 0.0, 0.0, 0
    for group, error in zip(windows.groups, errors, strict=True):
        valid, weight = group.weight[..., column] > 0, group.weight[..., column]
        mean = np.sum(group.measured[..., column] * valid, axis=1) / np.maximum(valid.sum(axis=1), 1)
        moved += float(np.sum(((group.measured[..., column] - mean[:, None]) * weight) ** 2))
        wrong += float(np.sum(error[..., column] ** 2))
        count += int(valid.sum())
    return float(np.sqrt(wrong / max(moved, 1e-300))) if wrong > _CLEAR**2 * count else 0.0
