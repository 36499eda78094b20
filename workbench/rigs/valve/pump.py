"""Pump: a fixed pump, its shaft and direction valves in place of a servo-valve, with a gas accumulator as low side."""

from ...base.units import Spec
from ..schema import ORIFICE
from .kind import ValveKind

_NUMBERS = {
    "D": Spec("m^3/rad", 1e-9, 1e-3, "displacement of the pump"),
    "Cp": Spec("m^3/s/Pa", 0.0, 1e-9, "laminar leakage of the pump from delivery to suction"),
    "nmax": Spec("rad/s", 1.0, 1500.0, "shaft speed at full command"),
    "n": Spec("1", 1, 20, "identical pump units in parallel"),
    "Vp": Spec("m^3", 1e-7, 1e-2, "volume between pump and direction valves"),
    "Vs": Spec("m^3", 1e-7, 1e-1, "volume between direction valves, suction and the accumulator's line"),
    "Kd": Spec(ORIFICE, 1e-10, 1e-4, "flow of an open direction valve per root of its pressure drop"),
    "td": Spec("s", 1e-4, 1.0, "time constant in which a direction valve switches"),
    "Kr": Spec("m^3/s/Pa", 1e-12, 1e-6, "flow of the relief valve per pressure above its setting Ps"),
    "Vg": Spec("m^3", 1e-6, 10.0, "volume of the accumulator; a tank has a very large one"),
    "pg": Spec("Pa", 1e4, 5e7, "gas pressure of the empty accumulator, absolute"),
    "kg": Spec("1", 1.0, 1.7, "polytropic exponent of the gas"),
    "pk": Spec("Pa", 0.0, 1e7, "pressure that cracks the check valve towards the accumulator"),
    "Kc": Spec("m^3/s/Pa", 0.0, 1e-5, "flow of that check valve per pressure beyond cracking"),
    "Rl": Spec("Pa s/m^3", 0.0, 1e12, "laminar resistance of the accumulator's line"),
    "ChA": Spec("m^3/Pa", 0.0, 1e-9, "compliance of the hose of chamber A"),
    "ChB": Spec("m^3/Pa", 0.0, 1e-9, "compliance of the hose of chamber B"),
}
_MOTOR = {
    "Um": Spec("V", 1.0, 1e3, "voltage at full command"),
    "Rm": Spec("V/A", 1e-3, 100.0, "resistance of the winding"),
    "Lm": Spec("V s/A", 1e-6, 1.0, "inductance of the winding"),
    "km": Spec("V s/rad", 1e-4, 10.0, "motor constant: voltage per speed, torque per current"),
    "Jm": Spec("kg m^2", 1e-7, 1.0, "inertia of the shaft"),
    "T0": Spec("N m", 0.0, 100.0, "no-load torque"),
    "Tp": Spec("N m/Pa", 0.0, 1e-4, "torque lost per pressure of the pump"),
}
_SPEED_LOOP = {
    "Kn": Spec("1/(rad/s)", 0.0, 10.0, "proportional gain of the speed loop: share of full voltage per speed error"),
    "Tn": Spec("s", 1e-3, 100.0, "integral time of the speed loop"),
}
PUMP = ValveKind(
    name="pump",
    numbers=_NUMBERS,
    correctors={"speed": {}, "motor": _MOTOR, "speed-loop": _MOTOR | _SPEED_LOOP},
    slots=(
        "command",
        "direction",
        "pump_flow",
        "delivery_drop",
        "accumulator",
        "gas_stiffness",
        "motor_losses",
        "hoses",
        "loader",
    ),
    stages=("main",),
    figures={},
    slot_numbers={"motor_losses": "Rm"},
)
