"""A loop that closes through its reference, as in hybrid simulation: what is measured comes back into the reference."""

import numpy as np

from ..base.errors import InputError, nearest
from ..control.protocol import Controller, linear_view
from ..linear.interconnect import feedback, select, series
from ..linear.state_space import StateSpace, modal_form
from .designed_inverse import ReferenceInverse
from .margins import STABLE, LinearLoop, refined, with_margins
from .plant_response import PlantResponse, near

_ROUNDS, _INSIDE = 3, 7  # each splits the intervals of crossings and peaks by so many points


def outer_loop(
    sampled: PlantResponse, controller: Controller, outer: StateSpace, inverse: ReferenceInverse | None = None
) -> LinearLoop:
    """The loop of a controller on a plant, opened at the reference: r = H(z) G(z) y.

    G, `outer`, is a discrete system from measured signals, such as "force", to "reference", both as deviations; H is an
    inverse before the loop, late by its preview. Margins are those of -H G T, T from the reference to the signals;
    whether it is stable comes from the poles of both loops together. Nothing of it shows in the margins of the inner
    loop.
    Raises InputError for a G of other signals or of another period.
    """
    _check(outer, sampled)
    law = linear_view(controller, sampled.signals)
    signals = list(dict.fromkeys((*law.input_labels[1:], *outer.input_labels)))
    inner = feedback(select(sampled.model, ["command"], signals), law)
    through = outer if inverse is None else series(outer, inverse.law)
    inner = select(inner, ["reference"], list(through.input_labels))
    both = feedback(inner, through).poles()
    once = modal_form(select(series(inner, through), ["reference"], ["reference"]))

    def opened(f: np.ndarray) -> np.ndarray:
        z = np.exp(2j * np.pi * f * sampled.period)
        return -once.outputs(once.states(z))[:, 0]

    f = np.unique(np.append(sampled.f, near(np.append(both, inner.poles()), sampled.period)))
    f, (loop,) = refined(opened, f, opened(f), _ROUNDS, _INSIDE)
    if not np.abs(both).max() < STABLE:
        return LinearLoop(False, f, loop, None, None, None, None, None)
    return with_margins(f, loop, "linear")


def _check(outer: StateSpace, sampled: PlantResponse) -> None:
    known = sampled.model.output_labels
    if unknown := [name for name in outer.input_labels if name not in known]:
        raise InputError(f'outer loop: no signal "{unknown[0]}"; {nearest(unknown[0], known)}')
    if outer.output_labels != ["reference"]:
        raise InputError(f'outer loop: gives {", ".join(outer.output_labels)}; make it give "reference"')
    if not np.isclose(outer.dt, sampled.period):
        raise InputError(f"outer loop: its period is {outer.dt:g} s, the rig's {sampled.period:g} s; sample it so")
