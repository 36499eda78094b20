"""A platform ready for its loops: plant, engine, operating point, and what decouples it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...engine import Engine
from ...linear import Equilibrium
from ...linear.platform_modes import decoupling, platform_equilibrium
from ...plant.platform import build_platform
from ...rigs.platform import Platform
from ...rigs.rig import Rig
from ..guard_numbers import LegLoad
from ..rig_variations import with_delay


@dataclass(frozen=True, eq=False)
class PlatformSetup:
    """A platform as built, its operating point at a pose, the same without dry friction, and its decoupled form:
    directions [6, 6] of leg space with the masses [6] along them, and the mass [6] that each leg alone moves, kg;
    and what its guards take each leg to carry [6] and all of them to move, the inertia [6, 6] of the legs, kg."""

    platform: Platform
    engine: Engine
    null: Equilibrium
    smooth: Equilibrium
    p_smooth: np.ndarray
    directions: np.ndarray
    masses: np.ndarray
    leg_masses: np.ndarray
    carried: tuple[LegLoad, ...]
    inertia: np.ndarray

    @property
    def guarded(self) -> tuple[Rig, ...]:
        """The rigs of the legs, each with the mass that its leg alone moves."""
        pairs = zip(self.platform.legs, self.leg_masses, strict=True)
        return tuple(leg.rig.with_values(M=float(mass)) for leg, mass in pairs)

    def known_as(self, declared: "PlatformSetup") -> "PlatformSetup":
        """This platform, of which loops and guards know what the `declared` one is, not what this one is."""
        names = ("directions", "leg_masses", "carried", "inertia")
        return replace(self, **{name: getattr(declared, name) for name in names})

    def with_payload(self, values: Mapping[str, float]) -> "PlatformSetup":
        """The platform with other numbers of the payload, SI by name; its laws and guards are still those of this one.
        Raises InputError where the jacks cannot hold it."""
        return platform_setup(self.platform.with_values(**values)).known_as(self)


def platform_setup(
    platform: Platform, delay: float = 0.0, pose: np.ndarray | None = None, brief: bool = True
) -> PlatformSetup:
    """Build a platform whose commands come `delay` [s] late, and hold it in a pose [6] (home). `brief`: as of Engine.
    Raises InputError where the jacks cannot hold it."""
    platform = platform.with_rigs(lambda rig: with_delay(rig, delay))
    engine = Engine(build_platform(platform), brief=brief)
    plant, smooth = engine.plant, engine.plant.without_dry_friction()
    null, calm = platform_equilibrium(plant, pose), platform_equilibrium(plant, pose, smooth)
    directions, masses = decoupling(plant, calm, smooth)
    leg_masses = 1 / np.sum(directions**2 / masses, axis=1)
    held = _carried(platform, engine, null, masses), (directions * masses) @ directions.T
    return PlatformSetup(platform, engine, null, calm, smooth, directions, masses, leg_masses, *held)


def _carried(platform: Platform, engine: Engine, null: Equilibrium, masses: np.ndarray) -> tuple[LegLoad, ...]:
    """By each leg: of any direction in which the platform may move; at rest, what pressures and load cell say."""
    outputs = dict(zip(engine.plant.outputs, engine.observe(null.x, null.u).tolist(), strict=True))
    legs = []
    for i, leg in enumerate(platform.legs):
        load = outputs[f"leg{i + 1}.jack_force"]
        weight, rod = load - outputs[f"leg{i + 1}.force"], leg.numbers["rod_mass"].value
        legs.append(LegLoad(float(max(masses)), float(min(masses)), load, rod, weight))
    return tuple(legs)
