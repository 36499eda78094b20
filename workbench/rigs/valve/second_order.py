"""Second-order: a spool with its drive as one oscillator, for a valve that is known by its datasheet alone."""

from ...base.units import Spec
from .kind import ValveKind
from .lands import MAIN_LANDS, RATED, SLOTS

_NUMBERS = {
    "f0": Spec("Hz", 0.5, 2e3, "natural frequency of the spool with its drive"),
    "zeta": Spec("1", 0.05, 5.0, "damping ratio of the spool with its drive"),
    "z0": Spec("1", -0.5, 0.5, "spool offset at zero command, over full travel"),
    **MAIN_LANDS,
}
_FIGURES = {
    **RATED,
    "leakage": Spec("m^3/s", 1e-10, 1e-2, "flow from supply to return at null, ports closed"),
    "leakage_drop": Spec("Pa", 1e4, 1e8, "supply less return at which the leakage was measured"),
}
SECOND_ORDER = ValveKind(
    name="second-order",
    numbers=_NUMBERS,
    slots=(*SLOTS, "magnet", "corrector", "spool_friction", "spool_speed"),
    stages=("main",),
    figures=_FIGURES,
)
