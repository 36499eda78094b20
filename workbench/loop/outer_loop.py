"""A loop that closes through its reference, as in hybrid simulation: what is measured comes back into the reference."""

import numpy as np

from ..base.errors import InputError, nearest
from ..control.protocol import Controller, linear_view
from ..linear.interconnect import feedback, select, series
from ..linear.state_space import StateSpace
from .designed_inverse import ReferenceInverse
from .margins import STABLE, LinearLoop, with_margins
from .open_loops import near, opened, unit_circle
from .sampled_lanes import LaneResponse, SampledLanes


def outer_loop(
    sampled: SampledLanes, controller: Controller, outer: StateSpace, inverse: ReferenceInverse | None = None
) -> LinearLoop:
    """The loop of a controller on a plant, opened at the reference: r = H(z) G(z) y.

    G, `outer`, is a discrete system from measured signals, such as "force", to "reference", both as deviations; H is an
    inverse before the loop, late by its preview. Margins are those of -H G T, T from the reference to the signals;
    whether it is stable comes from the poles of both loops together. Nothing of it shows in the margins of the inner
    loop.
    Raises InputError for a G of other signals or of another period.
    """
    _check(outer, sampled)
    law = linear_view(controller, sampled.point)
    signals = list(dict.fromkeys((*law.input_labels[1:], *outer.input_labels)))
    inner = feedback(select(sampled.model, ["command"], signals), law)
    through = outer if inverse is None else series(outer, inverse.law)
    inner = select(inner, ["reference"], list(through.input_labels))
    both = feedback(inner, through).poles()
    once = select(series(inner, through), ["reference"], ["reference"])
    response = LaneResponse.of(once.A[None], once.B[None, :, 0], once.C[None], once.D[None, :, 0])

    def at(_lanes: np.ndarray, f: np.ndarray) -> np.ndarray:
        return -response.at(unit_circle(f, sampled.period))[:, 0]

    poles = np.concatenate((both, inner.poles(), sampled.response.modes[0]))
    f = np.sort(np.append(sampled.f, near(poles[None], sampled.period)))[None]
    return with_margins(opened(at, f, at(np.zeros(1, int), f)), bool(np.abs(both).max() < STABLE), "linear")


def _check(outer: StateSpace, sampled: SampledLanes) -> None:
    known = sampled.measures
    if unknown := [name for name in outer.input_labels if name not in known]:
        raise InputError(f'outer loop: no signal "{unknown[0]}"; {nearest(unknown[0], known)}')
    if outer.output_labels != ["reference"]:
        raise InputError(f'outer loop: gives {", ".join(outer.output_labels)}; make it give "reference"')
    if not np.isclose(outer.dt, sampled.period):
        raise InputError(f"outer loop: its period is {outer.dt:g} s, the rig's {sampled.period:g} s; sample it so")
