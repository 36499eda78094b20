"""Two-way pump: a fixed pump that turns both ways between the chambers, with an accumulator as the low side."""

from ...base.units import Spec
from ..schema import ORIFICE
from .kind import ValveKind
from .pump import PUMP

_LIKE_A_ONE_WAY_PUMP = ("D", "Cp", "nmax", "n", "Kr", "Vg", "pg", "kg", "pk", "Kc", "Rl", "ChA", "ChB")
_NUMBERS = {name: PUMP.numbers[name] for name in _LIKE_A_ONE_WAY_PUMP} | {
    "Vs": Spec("m^3", 1e-7, 1e-1, "volume between shuttle valve, anti-cavitation valves and the accumulator's line"),
    "Kd": Spec(ORIFICE, 1e-10, 1e-4, "flow of the open shuttle valve per root of its pressure drop"),
    "pd": Spec("Pa", 1e3, 1e7, "difference of the chambers' pressures that half opens the shuttle valve"),
    "Kv": Spec("m^3/s/Pa", 0.0, 1e-5, "flow of an anti-cavitation valve per pressure beyond cracking"),
    "pv": Spec("Pa", 0.0, 1e7, "pressure that cracks an anti-cavitation valve"),
}
TWO_WAY_PUMP = ValveKind(
    name="two-way-pump",
    numbers=_NUMBERS,
    correctors=PUMP.correctors,
    slots=tuple(slot for slot in PUMP.slots if slot not in ("direction", "delivery_drop")),
    stages=("main",),
    figures={},
    slot_numbers=PUMP.slot_numbers,
)
