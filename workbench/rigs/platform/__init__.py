"""A platform on six jacks in the place of a rig: a payload, six legs with a jack rig each, and their geometry.

platform        what it is; the bundled ones are beside this file
platform_file   its TOML file
effects         friction and play of joints, and a payload that gives way
kinematics      pose to legs and back, in numpy alone
"""

from .effects import PlatformEffect, platform_effect
from .kinematics import AXES, Geometry, forward, leg_lengths, leg_speeds, pose_rates
from .platform import LEGS, Leg, Platform
from .platform_file import bundled_platforms, is_platform, load_platform, load_rig_or_platform

__all__ = [
    "AXES",
    "LEGS",
    "Geometry",
    "Leg",
    "Platform",
    "PlatformEffect",
    "bundled_platforms",
    "forward",
    "is_platform",
    "leg_lengths",
    "leg_speeds",
    "load_platform",
    "load_rig_or_platform",
    "platform_effect",
    "pose_rates",
]
