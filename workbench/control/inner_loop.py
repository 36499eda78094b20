"""The jack as an outer controller sees it: with compensators on its command closed, and how steps on it overshoot."""

from collections.abc import Sequence

import control
import numpy as np

from ..linear import Equilibrium, discretise
from ..linear.frequency_response import sampled_response
from ..plant import Plant
from .compensators import Compensator


def inner_loop_closed(
    plant: Plant,
    about: Equilibrium,
    period: float,
    compensators: Sequence[Compensator],
    p: np.ndarray | None = None,
) -> control.StateSpace:
    """Discrete state space from an outer controller's command to the position [m], `compensators` in between.

    The plant is linearised at a point and sampled every `period` [s], as `linear.discretise` does. What compensators do
    with a reference is left out.
    """
    laws = [part.law for part in compensators if part.into == "command"]
    seen = dict.fromkeys(name for law in laws for name in law.input_labels if name not in ("reference", "position"))
    model = discretise(plant, about, period, ("position", *seen), p)
    for law in laws:
        model = _closed(model, law)
    parts = (np.asarray(getattr(model, part)) for part in "AB")
    names = {"inputs": ["command"], "outputs": ["position"], "name": f"{plant.name} damped".replace(".", "_")}
    return control.StateSpace(*parts, np.asarray(model.C)[:1], 0, period, **names)


def _closed(model: control.StateSpace, law: control.StateSpace) -> control.StateSpace:
    """The same inputs and outputs with what a law makes of the outputs added to the input."""
    a, b, c = (np.asarray(part) for part in (model.A, model.B, model.C))
    taken = [name for name in law.input_labels if name != "reference"]
    columns = [law.input_labels.index(name) for name in taken]
    ac, cc = np.asarray(law.A), np.asarray(law.C)
    bc, dc = np.asarray(law.B)[:, columns], np.asarray(law.D)[:, columns]
    picked = c[[model.output_labels.index(name) for name in taken]]
    whole = np.block([[a + b @ dc @ picked, b @ cc], [bc @ picked, ac]])
    entering, leaving = np.vstack((b, np.zeros((len(ac), 1)))), np.hstack((c, np.zeros((len(c), len(ac)))))
    return control.StateSpace(whole, entering, leaving, 0, model.dt, inputs=["command"], outputs=model.output_labels)


def overshoots(
    plant: control.StateSpace, law: control.StateSpace, gains: Sequence[float], seconds: float = 2.0
) -> list[float | None]:
    """Overshoot [percent] of a step of the reference in the linear loop, for each factor on the law's gain.

    `law` is a controller's linear view, from reference and position to command. None where the loop is unstable.
    """
    times = np.arange(round(seconds / plant.dt)) * plant.dt
    loops = [_loop(plant, law, gain) for gain in gains]
    answers = [None if loop is None else control.step_response(loop, times).outputs for loop in loops]
    return [None if answer is None else 100 * max(0.0, float(np.max(answer)) - 1) for answer in answers]


def peak(plant: control.StateSpace, law: control.StateSpace) -> float:
    """Largest gain [1] from the reference to the position in the linear loop; without end where it is unstable."""
    loop = _loop(plant, law, 1.0)
    if loop is None:
        return np.inf
    f = np.geomspace(0.01, 0.5 / plant.dt, 400)
    return float(np.abs(sampled_response(loop, np.exp(2j * np.pi * f * plant.dt))).max())


def _loop(plant: control.StateSpace, law: control.StateSpace, gain: float) -> control.StateSpace | None:
    """Reference -> position; None where that is unstable."""
    a, b, c = (np.asarray(part) for part in (plant.A, plant.B, plant.C))
    ac, bc, cc, dc = (np.asarray(part) for part in (law.A, law.B, law.C, law.D))
    whole = np.block([[a + gain * b @ dc[:, 1:] @ c, gain * b @ cc], [bc[:, 1:] @ c, ac]])
    if not np.abs(np.linalg.eigvals(whole)).max() < 1 - 1e-9:
        return None
    entering, leaving = np.vstack((gain * b @ dc[:, :1], bc[:, :1])), np.hstack((c, np.zeros((1, len(ac)))))
    return control.StateSpace(whole, entering, leaving, 0, plant.dt)
