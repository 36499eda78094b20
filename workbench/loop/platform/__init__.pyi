from .loop import PlatformRun as PlatformRun, leg_references as leg_references, run_platform as run_platform
from .setup import PlatformSetup as PlatformSetup, platform_setup as platform_setup
