"""The engine: a plant, a command held over each control period, and an adaptive implicit step, all one graph."""

from .delay_line import DelayLine, periods
from .driver import Batch
from .engine import Engine
from .trajectory import Trajectory

__all__ = ["Batch", "DelayLine", "Engine", "Trajectory", "periods"]
