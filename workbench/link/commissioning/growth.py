"""How fast a relay's command may grow: as fast as the plants take it that the datasheet allows.

A command that grows by g drives a jack of the speed gain Kv over a way w at about the root of 2 g w Kv: speed, and the
swing of pressure and force with it, fall with the root of g. So does the frequency of the turns, while a shorter way
would bring them nearer to the mode of the oil.
"""

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...loop.drive_simulation import SMALLER, drive
from .allowed import Allowed
from .obstacles import Barred, Obstacle
from .relay import GROWTH, Relay, relay_reference

_TRIES = 6  # of which the last takes six times as long
_CHUNK = 0.3  # s: how soon one that has turned for the last time, and rung, is looked at no more


def safe_growth(plants: Allowed, way: float, size: float = 0.0) -> float:
    """By how much [1/s] the command of a relay grows that turns at `way` [m] and begins at `size` [1], where no plant
    comes near a limit of the rig. Raises Barred where one does that however slowly it grows."""
    inner, why = drive(plants.rig).loop, None
    for growth in GROWTH * SMALLER ** np.arange(_TRIES):
        why = _trouble(plants, inner, way, size, float(growth))
        if why is None:
            return float(growth)
    raise Barred(
        Obstacle(
            f"the limits leave no room for moves of {1e3 * way:.3g} mm, however slow, that tell what the rig is: {why}",
            "nothing more is played, and there is no controller",
            "widen that limit of the rig",
        )
    )


def _trouble(plants: Allowed, inner: ControllerSpec, way: float, size: float, growth: float) -> str | None:
    """Which limit the plants at the ends of the bounds come near to in a relay, and which one does."""
    tried = (_trouble_on(plants, lane, inner, way, size, growth) for lane in plants.ends)
    return next(filter(None, tried), None)


def _trouble_on(
    plants: Allowed, lane: int, inner: ControllerSpec, way: float, size: float, growth: float
) -> str | None:
    """What `_trouble` says of one plant. A guard that trips there, no limit being near, is no trouble."""
    period = plants.rig.period.value
    relay = Relay(inner.build(period), period, size, growth=growth)
    loop, level = plants.loop(relay, lane, 0.0)
    relay.begin()
    whole = level + relay_reference(plants.rig, way, growth)
    for part in np.array_split(whole, round(len(whole) * period / _CHUNK)):
        rings = not relay.grows
        run = loop.run(part)
        if (why := plants.near_limit(run, lane)) or rings or run.tripped:
            return why
    return None
