"""Physics that the library of effects has not: other formulas of what it names, and causes that it does not name.

Studies draw campaigns with them to see how a trace does where its formulas do not fit. No rig can declare them.

drive, valve, hydraulics, motion, pump    formulas of known effects that the library lacks, by where they act
unnamed    effects that the library has no name for; those of pump drives are in pump
"""

from . import drive, hydraulics, motion, pump, unnamed as nameless, valve

OTHER_FORMULAS = (*drive.EFFECTS, *valve.EFFECTS, *hydraulics.EFFECTS, *motion.EFFECTS, *pump.FORMULAS)
UNNAMED = (*nameless.EFFECTS, *pump.CAUSES)

__all__ = ["OTHER_FORMULAS", "UNNAMED"]
