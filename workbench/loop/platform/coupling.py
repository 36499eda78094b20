"""What a platform's guards know of what its legs do to each other."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...engine.guard_coupling import COUPLED, coupling
from ...engine.guard_shape import packed
from ..guard import Guard
from ..guard_numbers import left_to_brake
from .setup import PlatformSetup


def coupling_numbers(setup: PlatformSetup) -> np.ndarray:
    """The numbers [k] of guard_coupling, SI."""
    pairs = list(zip(setup.guarded, setup.carried, strict=True))
    left = np.array([left_to_brake(rig, carried) for rig, carried in pairs])
    return packed(
        COUPLED,
        inertia=setup.inertia.ravel(),
        mobility=np.linalg.inv(setup.inertia).ravel(),
        load=np.array([carried.load for carried in setup.carried]),
        drag=np.array([rig["b"] for rig in setup.guarded]),
        left=left,
        least=left / np.array([carried.most for carried in setup.carried]),
    )


class Coupling:
    """The same evaluated sample by sample, for guards in Python."""

    def __init__(self, setup: PlatformSetup) -> None:
        self._areas = np.array([rig.areas for rig in setup.guarded])
        self._numbers, self._graph = coupling_numbers(setup), coupling()

    def of(
        self, guards: Sequence[Guard], measured: Sequence[Mapping[str, float]]
    ) -> Sequence[tuple[float, float] | None]:
        """For each leg how all accelerate and how fast all brake it, m/s^2; None where its pressures are not read."""
        if not {"pa", "pb"} <= measured[0].keys():
            return [None] * len(guards)
        pressed = [
            areas[0] * reading["pa"] - areas[1] * reading["pb"]
            for areas, reading in zip(self._areas, measured, strict=True)
        ]
        answer = self._graph(self._numbers, np.array([guard.speed for guard in guards]), np.array(pressed))
        accelerations, braking = (np.array(part).ravel().tolist() for part in answer)
        return list(zip(accelerations, braking, strict=True))
