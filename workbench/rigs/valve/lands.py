"""Numbers that every valve with a main spool has: its lands, and how many such valves feed the jack."""

from ...base.units import Spec
from ..schema import GRADIENT

MAIN_LANDS = {
    "K3": Spec(GRADIENT, 1e-7, 0.5, "flow gradient of the main lands: flow per spool travel and root of pressure drop"),
    "z3max": Spec("m", 1e-5, 0.05, "main-spool travel at full command"),
    "eps": Spec("m", 1e-8, 1e-3, "lap length: leakage at null is that of this much opening"),
    "n": Spec("1", 1, 20, "identical valves in parallel"),
}
RATED = {
    "rated_flow": Spec("m^3/s", 1e-8, 1.0, "flow of one valve at full command"),
    "rated_drop": Spec("Pa", 1e4, 1e8, "pressure drop over both lands at which it was measured"),
    "n": MAIN_LANDS["n"],
}
"""What every datasheet states of a main spool."""
WIDTHS = {
    "hysteresis": Spec("1", 0.0, 0.5, "width of the loop of hysteresis, over full command"),
    "threshold": Spec("1", 0.0, 0.1, "least change of the command that the spool answers, over full command"),
}
"""What a datasheet of a valve may state, too."""

SLOTS = ("command", "main_openings", "main_flows")
"""Slots that the equations of every main spool have."""
