"""The jack as an outer controller sees it: with compensators on its command closed, and how steps on it overshoot."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias, cast

import numpy as np

from ..linear import Equilibrium
from ..linear.interconnect import feedback, select
from ..linear.sampling import sampled_plant
from ..linear.state_space import StateSpace, as_state_space, sampled_response
from .compensators import Compensator, MapsCommand

if TYPE_CHECKING:
    import control

    from ..plant import Plant

Linear: TypeAlias = "StateSpace | control.StateSpace"


def inner_loop_closed(
    plant: "Plant",
    about: Equilibrium,
    period: float,
    compensators: Sequence[Compensator | MapsCommand],
    p: np.ndarray | None = None,
) -> StateSpace:
    """Discrete state space from an outer controller's command to the position [m], `compensators` in between.

    The plant is linearised at a point and sampled every `period` [s], as `linear.discretise` does; a schedule has its
    factor there, a map of the command its slope. What compensators do with a reference is left out.
    """
    filters = [as_state_space(cast(Compensator, part).law) for part in compensators if part.into == "command"]
    known = ("reference", "position")
    measured = dict.fromkeys(name for law in filters for name in law.input_labels if name not in known)
    model = sampled_plant(plant, about, period, ("position", *measured), p)
    model = replace(model, D=np.zeros_like(model.D))  # what is measured has not heard of this command yet
    outputs = np.array(plant.h(about.x, about.u, plant.p if p is None else p)).ravel()
    position, command = float(outputs[plant.output("position")]), float(about.u[0])
    for part in reversed(compensators):  # the last is next to the plant
        if part.into == "map":
            command_map = cast(MapsCommand, part).command_map
            command += command_map.back(command)
            model = replace(model, B=model.B * (1 + command_map.shift.slope(command)))
        elif part.into == "command":
            law, schedule = as_state_space(cast(Compensator, part).law), getattr(part, "schedule", None)
            factor = schedule(position) if schedule else 1.0
            law = replace(law.relabelled(law.input_labels, ["command"]), C=factor * law.C, D=factor * law.D)
            model = feedback(model, law)
    return select(model, ["command"], ["position"])


def overshoots(plant: Linear, law: Linear, gains: Sequence[float]) -> list[float | None]:
    """Overshoot [percent] in 2 s of a step of the reference in the linear loop, for each factor on the law's gain.

    `law` is a controller's linear view, from reference and position to command. None where the loop is unstable.
    """
    count = round(2.0 / float(plant.dt or 0.0))
    loops = [_loop(plant, law, gain) for gain in gains]
    return [None if loop is None else 100 * max(0.0, float(_step(loop, count).max()) - 1) for loop in loops]


def _step(loop: StateSpace, count: int) -> np.ndarray:
    """The output [count] of a discrete system whose one input steps to 1 at the start.

    By doubling: the states of the next m samples are A^m times those of the last m, the input being a state too.
    """
    n = len(loop.A)
    a = np.block([[loop.A, loop.B[:, :1]], [np.zeros((1, n)), np.ones((1, 1))]])
    x = np.eye(n + 1)[:, -1:]
    while x.shape[1] < count:
        x, a = np.hstack((x, a @ x)), a @ a
    return (np.append(loop.C[0], loop.D[0, 0]) @ x)[:count]


def peak(plant: Linear, law: Linear) -> float:
    """Largest gain [1] from the reference to the position in the linear loop; without end where it is unstable."""
    loop = _loop(plant, law, 1.0)
    if loop is None:
        return np.inf
    f = np.geomspace(0.01, 0.5 / loop.dt, 400)
    return float(np.abs(sampled_response(loop, np.exp(2j * np.pi * f * loop.dt))).max())


def _loop(plant: Linear, law: Linear, gain: float) -> StateSpace | None:
    """Reference -> position; None where that is unstable."""
    jack = as_state_space(plant).relabelled(["command"], ["position"])
    position_law = as_state_space(law).relabelled(["reference", "position"], ["command"])
    scaled = replace(position_law, C=gain * position_law.C, D=gain * position_law.D)
    loop = select(feedback(jack, scaled), ["reference"], ["position"])
    return loop if np.abs(loop.poles()).max() < 1 - 1e-9 else None
