"""A platform on six jacks as an FMU: its plant, held at home, without a controller."""

from ...base.errors import InputError
from ...linear.platform_modes import platform_equilibrium
from ...plant.platform import build_platform
from ...rigs.platform import Platform
from ...rigs.platform.platform import JOINTS, LEG, PAYLOAD, PLACE
from .model import FmuModel, numbers_of, with_cavitation

_JOINTS = {f"{end}_{axis}": ("m", f"joint of the leg on the {frame}, along {axis}")
           for end, frame in (("base", "base"), ("joint", "platform")) for axis in "xyz"}  # fmt: skip


def platform_model(platform: Platform) -> FmuModel:
    """The plant of a platform at rest at home: commands and a wrench in; pose, twist and the signals of each leg out.

    Raises InputError where its drives hold commands back, which an FMU without a controller cannot.
    """
    plant = build_platform(platform)
    if plant.lateness():
        raise InputError(f"platform {platform.name}: its drives hold commands back by {1e3 * plant.lateness():g} ms")
    own = {name: (spec.unit, spec.meaning) for name, spec in {**PAYLOAD, **PLACE, **JOINTS}.items()}
    of_leg = {name: (spec.unit, spec.meaning) for name, spec in LEG.items()} | _JOINTS
    for i, leg in enumerate(platform.legs, 1):
        own |= {f"leg{i}.{name}": told for name, told in {**of_leg, **numbers_of(leg.rig)}.items()}
    about = platform_equilibrium(plant, None)
    plant, x = with_cavitation(plant, about.x)
    return FmuModel(platform.name, platform.title, platform.period, own, plant, x, about.u, None)
