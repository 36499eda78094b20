"""The engine: a plant, a command held over each control period, and an adaptive implicit step, all one graph."""

from .driver import Batch
from .engine import Engine, Trajectory
from .late import Line, periods

__all__ = ["Batch", "Engine", "Line", "Trajectory", "periods"]
