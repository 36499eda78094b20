"""Which numbers a rig has, by kind of valve and jack: meaning, SI unit and the range that physics allows."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Spec:
    """A number's SI unit, the widest range that is physically possible [SI] and its meaning."""

    unit: str
    low: float
    high: float
    meaning: str


_ORIFICE = "m^3/s/Pa^0.5"
_GRADIENT = "m^2/s/Pa^0.5"

SUPPLY = {
    "Ps": Spec("Pa", 1e5, 1e8, "supply pressure, absolute"),
    "Pr": Spec("Pa", 0.0, 1e7, "return pressure, absolute"),
}
OIL = {"beta": Spec("Pa", 1e7, 5e9, "effective bulk modulus")}

_MAIN_LANDS = {
    "K3": Spec(
        _GRADIENT, 1e-8, 1.0, "flow gradient of the main lands: flow per spool travel and root of pressure drop"
    ),
    "z3max": Spec("m", 1e-6, 0.1, "main-spool travel at full command"),
    "eps": Spec("m", 1e-9, 1e-3, "lap length: leakage at null is that of this much opening"),
    "n": Spec("1", 1, 20, "identical valves in parallel"),
}
THREE_STAGE = {
    "L": Spec("m", 1e-3, 1.0, "arm of the feedback spring"),
    "l": Spec("m", 1e-4, 1.0, "arm of the nozzles"),
    "Dbuse": Spec("m", 1e-5, 1e-2, "nozzle diameter"),
    "Sbuse": Spec("m^2", 1e-10, 1e-4, "nozzle area"),
    "xo": Spec("m", 1e-6, 1e-3, "flapper to nozzle gap at null"),
    "Kbuse": Spec("m/s/Pa^0.5", 1e-4, 1.0, "nozzle flow coefficient"),
    "K1": Spec(_ORIFICE, 1e-12, 1e-6, "fixed orifice of the first stage"),
    "Kf2": Spec(_ORIFICE, 0.0, 1e-6, "leak from supply past the pilot spool"),
    "Vo2": Spec("m^3", 1e-12, 1e-3, "volume of a nozzle chamber at null"),
    "S2": Spec("m^2", 1e-7, 1e-2, "end area of the pilot spool"),
    "J": Spec("kg m^2", 1e-10, 1e-2, "inertia of the torque motor's armature"),
    "phi": Spec("N m s/rad", 0.0, 1.0, "damping of the armature"),
    "Kr2": Spec("N/m", 0.0, 1e7, "stiffness of the feedback spring at the spool"),
    "M2": Spec("kg", 1e-5, 10.0, "mass of the pilot spool"),
    "psi2": Spec("N s/m", 0.0, 1e5, "viscous friction of the pilot spool"),
    "K2": Spec(_GRADIENT, 1e-8, 1.0, "flow gradient of the pilot lands"),
    "z2max": Spec("m", 1e-6, 1e-2, "travel of the pilot spool to its stop"),
    "Kf3": Spec(_ORIFICE, 0.0, 1e-6, "leak from supply past the main spool into an end chamber"),
    "S3": Spec("m^2", 1e-6, 1.0, "end area of the main spool"),
    "Vo3": Spec("m^3", 1e-9, 1e-2, "volume of a main-spool end chamber at null"),
    "M3": Spec("kg", 1e-4, 100.0, "mass of the main spool"),
    "psi3": Spec("N s/m", 0.0, 1e6, "viscous friction of the main spool"),
    "Km": Spec("N m/A", 1e-4, 100.0, "torque-motor gain"),
    "Knet": Spec("N m/rad", -100.0, 100.0, "net stiffness of the armature: flexure less magnetic"),
    "kstop": Spec("N/m", 0.0, 1e9, "stiffness of the flapper on a closed nozzle"),
    "cff2": Spec("N/(m Pa)", 0.0, 1.0, "flow force of the pilot spool per opening and pressure drop"),
    "rff3": Spec("N s/(m^3 Pa^0.5)", 0.0, 1e4, "flow force of the main spool, per flow gradient K3"),
    "Fs1": Spec("N m", 0.0, 1.0, "Coulomb friction of the armature"),
    "Fs2": Spec("N", 0.0, 1e3, "Coulomb friction of the pilot spool"),
    "Fs3": Spec("N", 0.0, 1e5, "Coulomb friction of the main spool"),
    "k2stop": Spec("N/m", 1e6, 1e12, "stiffness of the pilot-spool stop"),
    "k3stop": Spec("N/m", 1e6, 1e12, "stiffness of the main-spool stop"),
    "z3over": Spec("1", 1.0, 3.0, "main-spool stop over travel at full command"),
    "imax": Spec("A", 1e-4, 10.0, "rated current"),
    "isat": Spec("1", 0.1, 5.0, "current limit over rated current"),
    "Kp": Spec("1", 1e-3, 1e3, "proportional gain of the spool loop"),
    **_MAIN_LANDS,
}
CORRECTORS = {
    "p": {},
    "p-lead": {"Td": Spec("s", 0.0, 1.0, "lead time of the spool loop"), "tf": Spec("s", 1e-6, 1.0, "its filter")},
    "pi-lead": {
        "Ti": Spec("s", 1e-5, 1e3, "integral time of the spool loop"),
        "Td": Spec("s", 0.0, 1.0, "lead time of the spool loop"),
        "tf": Spec("s", 1e-6, 1.0, "filter of the lead"),
    },
}
SECOND_ORDER = {
    "f0": Spec("Hz", 0.1, 1e4, "natural frequency of the spool with its drive"),
    "zeta": Spec("1", 0.01, 10.0, "damping ratio of the spool with its drive"),
    "z0": Spec("1", -0.5, 0.5, "spool offset at zero command, over full travel"),
    **_MAIN_LANDS,
}
VALVES = {"three-stage": THREE_STAGE, "second-order": SECOND_ORDER}

_JACK = {
    "S": Spec("m", 1e-3, 100.0, "stroke between the end stops"),
    "xmid": Spec("m", -100.0, 100.0, "position signal at mid stroke"),
    "Cl": Spec("m^3/s/Pa", 0.0, 1e-6, "laminar leakage between the chambers"),
    "ke": Spec("N/m", 1e3, 1e12, "stiffness of an end stop"),
    "ce": Spec("N s/m", 0.0, 1e9, "damping of an end stop"),
}
JACKS = {
    "double-rod": {
        "Aj": Spec("m^2", 1e-6, 10.0, "piston area, both sides"),
        "V0": Spec("m^3", 1e-9, 1.0, "dead volume of a side"),
        **_JACK,
    },
    "differential": {
        "AA": Spec("m^2", 1e-6, 10.0, "piston area of chamber A"),
        "AB": Spec("m^2", 1e-6, 10.0, "annulus area of chamber B"),
        "V0A": Spec("m^3", 1e-9, 1.0, "dead volume of side A"),
        "V0B": Spec("m^3", 1e-9, 1.0, "dead volume of side B"),
        **_JACK,
    },
}
LOAD = {
    "M": Spec("kg", 1e-3, 1e7, "moving mass"),
    "b": Spec("N s/m", 0.0, 1e8, "viscous friction"),
    "ks": Spec("N/m", 0.0, 1e12, "specimen stiffness, 0: none"),
    "cs": Spec("N s/m", 0.0, 1e9, "specimen damping, 0: none"),
}
LIMITS = {
    "stroke": Spec("m", 1e-4, 100.0, "allowed distance from mid stroke"),
    "speed": Spec("m/s", 1e-4, 100.0, "allowed speed"),
    "force": Spec("N", 1.0, 1e9, "capacity of the load cell"),
    "command_rate": Spec("1/s", 1e-2, 1e6, "allowed rate of the command"),
}
CONTROL = {"period": Spec("s", 1e-6, 1.0, "control period")}
