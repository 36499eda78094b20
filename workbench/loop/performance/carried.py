"""What a jack, or an axis of a platform, carries: travel and force of each piston per unit of its motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...linear.linearisation import linear_plant
from ...linear.operating_point import equilibrium
from ...linear.state_space import StateSpace
from ...plant import build
from ...plant.platform import WRENCH
from ...rigs.platform import AXES, Platform, leg_speeds
from ...rigs.rig import Rig
from ..platform.reach import static_forces
from ..platform.setup import PlatformSetup


@dataclass(frozen=True, eq=False)
class LoadResponse:
    """A jack that moves by `travel` [m] a unit of a motion, over frequencies f [k] Hz.

    `force` [k] complex: pressure force of its piston, and `cell` [k] what its force limit is of, N a unit; `held` [N]:
    the pressure force at rest.
    """

    rig: Rig
    f: np.ndarray
    travel: float
    force: np.ndarray
    cell: np.ndarray
    held: float


def carried_by_jack(rig: Rig, f: np.ndarray) -> LoadResponse:
    """A jack's own position at mid stroke, by the model linearised there: mass, friction, specimen and all."""
    plant = build(rig)
    smooth = plant.without_dry_friction()
    rest = equilibrium(plant, p=smooth)
    names = ("pa", "pb", "force", "position")
    pa, pb, cell, position = response(linear_plant(plant, rest, outputs=names, p=smooth), f)
    area_a, area_b = rig.areas
    held = float(plant.observe(rest.x, rest.u)[0, plant.output("jack_force")])
    return LoadResponse(rig, f, 1.0, (area_a * pa - area_b * pb) / position, cell / position, held)


def carried_along(setup: PlatformSetup, axis: str, f: np.ndarray) -> Sequence[LoadResponse]:
    """What each leg of a platform carries that moves along an axis about home: payload and legs, by their inertia."""
    platform, way = setup.platform, np.eye(len(AXES))[AXES.index(axis)]
    jacobian = leg_speeds(platform.geometry, np.zeros(len(AXES)))
    travel = jacobian @ way
    pull = np.linalg.solve(jacobian.T, inertia(setup) @ way)  # N of each leg for an acceleration of 1
    held = static_forces(platform, np.zeros(len(AXES)))
    turn = -((2 * np.pi * f) ** 2)
    return [
        LoadResponse(leg.rig, f, float(travel[i]), turn * pull[i] + 0j, turn * pull[i] + 0j, float(held[i]))
        for i, leg in enumerate(platform.legs)
    ]


def inertia(setup: PlatformSetup) -> np.ndarray:
    """Generalised inertia [6, 6] at home of payload and legs, from a wrench to the acceleration of the pose."""
    plant, rest = setup.engine.plant, setup.null
    b = linear_plant(plant, rest, inputs=WRENCH, outputs=(AXES[0],), p=setup.p_smooth).B
    first = plant.state(AXES[0]) + len(AXES)
    return np.linalg.inv(b[first : first + len(AXES)])


def platform_axes(platform: Platform) -> dict[str, str]:
    """The unit of each axis."""
    return {axis: "m" if i < len(AXES) // 2 else "rad" for i, axis in enumerate(AXES)}


def response(linear: StateSpace, f: np.ndarray) -> np.ndarray:
    """The response to the first input at f [k] Hz, complex [outputs, k]."""
    turn = 2j * np.pi * f[:, None, None] * np.eye(len(linear.A)) - linear.A
    states = np.linalg.solve(turn, np.broadcast_to(linear.B[:, :1], (f.size, len(linear.A), 1)))
    return (linear.C @ states + linear.D[:, :1])[:, :, 0].T
