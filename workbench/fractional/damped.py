"""The jack as an outer controller sees it: with compensators on its command closed, and how steps on it overshoot."""

from collections.abc import Sequence

import control
import numpy as np

from ..compensator import Compensator
from ..plant import Plant
from ..views import Equilibrium, sampled


def damped(
    plant: Plant, about: Equilibrium, period: float, compensator: Compensator, p: np.ndarray | None = None
) -> control.StateSpace:
    """Discrete state space from an outer controller's command to the position [m], `compensator` in between.

    The plant is linearised at a point and sampled every `period` [s], as `views.sampled` does.
    """
    seen = compensator.law.input_labels
    model = sampled(plant, about, period, ("position", *seen), p)
    a, b, c = (np.asarray(part) for part in (model.A, model.B, model.C))
    ac, bc, cc, dc = (np.asarray(getattr(compensator.law, part)) for part in "ABCD")
    whole = np.block([[a + b @ dc @ c[1:], b @ cc], [bc @ c[1:], ac]])
    entering, leaving = np.vstack((b, np.zeros((len(ac), 1)))), np.hstack((c[:1], np.zeros((1, len(ac)))))
    names = {"inputs": ["command"], "outputs": ["position"], "name": f"{plant.name} damped".replace(".", "_")}
    return control.StateSpace(whole, entering, leaving, 0, period, **names)


def overshoots(
    plant: control.StateSpace, law: control.StateSpace, gains: Sequence[float], seconds: float = 2.0
) -> list[float | None]:
    """Overshoot [percent] of a step of the reference in the linear loop, for each factor on the law's gain.

    `law` is a controller's linear view, from reference and position to command. None where the loop is unstable.
    """
    a, b, c = (np.asarray(part) for part in (plant.A, plant.B, plant.C))
    ac, bc, cc, dc = (np.asarray(part) for part in (law.A, law.B, law.C, law.D))
    found: list[float | None] = []
    for gain in gains:
        whole = np.block([[a + gain * b @ dc[:, 1:] @ c, gain * b @ cc], [bc[:, 1:] @ c, ac]])
        if not np.abs(np.linalg.eigvals(whole)).max() < 1 - 1e-9:
            found.append(None)
            continue
        entering, leaving = np.vstack((gain * b @ dc[:, :1], bc[:, :1])), np.hstack((c, np.zeros((1, len(ac)))))
        times = np.arange(round(seconds / plant.dt)) * plant.dt
        answer = control.step_response(control.StateSpace(whole, entering, leaving, 0, plant.dt), times).outputs
        found.append(100 * max(0.0, float(np.max(answer)) - 1))
    return found
