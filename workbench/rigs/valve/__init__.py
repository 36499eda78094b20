"""The kinds of valve as rigs and datasheets know them: one file a kind, listed in VALVES.

kind            what is known of a kind: numbers, spool loops, slots, stages, figures of its datasheet
lands           what every main spool has
three_stage     torque motor and nozzles, pilot spool, main spool with a position loop
second_order    a spool with its drive as one oscillator
pump            a pump with its shaft and direction valves in place of a servo-valve
two_way_pump    one that turns both ways, between the chambers

The equations of a kind are in plant/valve, whose docstring says how to add one.
"""

from .kind import ValveKind
from .pump import PUMP
from .second_order import SECOND_ORDER
from .three_stage import THREE_STAGE
from .two_way_pump import TWO_WAY_PUMP

VALVES: dict[str, ValveKind] = {kind.name: kind for kind in (THREE_STAGE, SECOND_ORDER, PUMP, TWO_WAY_PUMP)}

__all__ = ["PUMP", "SECOND_ORDER", "THREE_STAGE", "TWO_WAY_PUMP", "VALVES", "ValveKind"]
