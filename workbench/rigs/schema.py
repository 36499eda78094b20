"""Numbers that every rig has: meaning, SI unit and the range that physics allows. Its valve and jack have more."""

from ..base.units import Spec
from .inner_loop import GAIN, POSITION, inner_specs

ORIFICE = "m^3/s/Pa^0.5"
GRADIENT = "m^2/s/Pa^0.5"

SUPPLY = {
    "Ps": Spec("Pa", 1e5, 1e8, "supply pressure, absolute"),
    "Pr": Spec("Pa", 0.0, 5e6, "return pressure, absolute"),
}
OIL = {"beta": Spec("Pa", 1e7, 5e9, "effective bulk modulus")}
GAS = {
    "gas": Spec("1", 1e-4, 0.2, "gas at 1 atm per volume of oil, which comes out of solution below 1 atm"),
    "Pv": Spec("Pa", 0.0, 5e4, "vapour pressure of the oil, absolute"),
}
"""Of the oil, too, and optional; rigs/oil.py has what mineral oil is."""
SHARED = {
    "other_AA": Spec("m^2", 1e-6, 3.0, "area of another function on the same pump, which oil pushes as it extends"),
    "other_AB": Spec("m^2", 1e-6, 3.0, "the same, as it retracts"),
}
"""Of a supply that two functions draw from, whose other one's position is recorded."""
FURTHER = {"supply": SHARED, "oil": GAS}
"""Numbers that a table may have or not."""
FURTHER_SPECS = {name: spec for specs in FURTHER.values() for name, spec in specs.items()}

LOAD = {
    "M": Spec("kg", 1e-2, 1e6, "moving mass"),
    "b": Spec("N s/m", 0.0, 1e7, "viscous friction"),
    "ks": Spec("N/m", 0.0, 1e11, "specimen stiffness, 0: none"),
    "cs": Spec("N s/m", 0.0, 1e8, "specimen damping, 0: none"),
}
LIMITS = {
    "stroke": Spec("m", 1e-4, 20.0, "allowed distance from mid stroke"),
    "speed": Spec("m/s", 1e-4, 50.0, "allowed speed"),
    "force": Spec("N", 1.0, 1e8, "capacity of the load cell"),
    "command_rate": Spec("1/s", 1e-2, 1e6, "allowed rate of the command"),
    "pressure": Spec("Pa", 1e4, 1e9, "allowed pressure of a chamber"),
    "least_pressure": Spec("Pa", -1e7, 1e8, "least pressure of a chamber that is allowed"),
    "command": Spec("1", 1e-3, 1.0, "largest command"),
    "following_error": Spec("m", 1e-6, 20.0, "allowed distance of the position from its reference"),
    "flow_error": Spec("1", 0.01, 10.0, "share of the travel that spool and pressures say, by which it may be another"),
}
FOLLOWING_TIME = 0.02  # s: that a following error beyond its limit may last
STOPS = ("close", "hold")  # what the guard does after a trip: close the valve, and then hold the jack where it stands
CONTROL = {
    "period": Spec("s", 1e-5, 1.0, "control period"),
    "computing_delay": Spec("s", 0.0, 0.1, "time from a sample to its command"),
    "deadline": Spec("s", 1e-5, 1.0, "longest time that a controller in Python may compute"),
}
SHUT_OFF = {
    "closing_time": Spec("s", 1e-4, 10.0, "time from a trip until the shut-off valve is closed"),
    "leak": Spec("1", 0.0, 1.0, "share of the servo-valve's flow that it lets through when closed"),
}
OPTIONAL = (
    *FURTHER_SPECS,
    *(name for name in inner_specs(POSITION) if name != GAIN),
    *("pressure", "least_pressure", "command", "following_error", "flow_error", "computing_delay", "deadline"),
)
"""Of supply, oil, inner loop, limits and control."""
