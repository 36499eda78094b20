"""Platforms drawn over what is uncertain of one: payload, pose and the numbers of each leg."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...linear.platform_modes import platform_equilibrium
from ...rigs.platform import AXES, LEGS
from .draw import PlatformDraw
from .setup import PlatformSetup

_CENTRE, _INERTIA = ("cx", "cy", "cz"), ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True, eq=False)
class DrawnPlatform:
    """One of them: its parameters p [k] and the operating points at its pose in `setup`, whose directions and guards
    stay those of the declared platform. `numbers`: its payload and pose by name, SI."""

    number: int
    p: np.ndarray
    pose: np.ndarray
    setup: PlatformSetup
    numbers: Mapping[str, float]


def drawn_platform(setup: PlatformSetup, draw: PlatformDraw, seed: int, number: int) -> DrawnPlatform:
    """Number so and so: the same whatever others are drawn. Raises InputError where jacks cannot hold it."""
    plant, platform = setup.engine.plant, setup.platform
    random = np.random.default_rng([seed, number])
    mass, shift = random.uniform(*draw.mass), random.uniform(-draw.centre, draw.centre, 3)
    pose = random.uniform(-1.0, 1.0, LEGS) * draw.pose
    payload = {name: mass * platform[name] for name in ("mass", *_INERTIA)}
    payload |= {name: platform[name] + float(by) for name, by in zip(_CENTRE, shift, strict=True)}
    values = payload | _legs(setup, draw, random)
    p = plant.parameter_values(None, **values)
    smooth = plant.without_dry_friction(p)
    try:
        null, calm = platform_equilibrium(plant, pose, p), platform_equilibrium(plant, pose, smooth)
    except InputError as error:
        raise InputError(f"drawn platform {number}: {error}; draw over less") from None
    own = replace(setup, null=null, smooth=calm, p_smooth=smooth)
    shown = {name: payload[name] for name in ("mass", *_CENTRE)} | dict(zip(AXES, pose.tolist(), strict=True))
    return DrawnPlatform(number, p, pose, own, shown)


def _legs(setup: PlatformSetup, draw: PlatformDraw, random: np.random.Generator) -> dict[str, float]:
    """Drawn numbers of the jacks, by the names of the platform's parameters."""
    there, values = set(setup.engine.plant.parameters), dict[str, float]()
    for i, leg in enumerate(setup.platform.legs):
        for name, number in leg.rig.numbers.items():
            place, share = f"leg{i + 1}.{name}", random.uniform()
            if name in draw.factors:
                low, high = (number.value * factor for factor in draw.factors[name])
            elif number.uncertain is not None:
                low, high = number.uncertain
            else:
                continue
            if place in there:
                values[place] = low + share * (high - low)
    return values
