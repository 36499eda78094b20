"""Three-stage: torque motor and nozzles, pilot spool, main spool with an electrical position loop (the paper's)."""

from ...base.units import Spec
from ..schema import GRADIENT, ORIFICE
from .kind import ValveKind
from .lands import MAIN_LANDS, RATED, SLOTS

_NUMBERS = {
    "L": Spec("m", 5e-3, 0.2, "arm of the feedback spring"),
    "l": Spec("m", 1e-3, 0.05, "arm of the nozzles"),
    "Dbuse": Spec("m", 5e-5, 3e-3, "nozzle diameter"),
    "Sbuse": Spec("m^2", 1e-9, 1e-5, "nozzle area"),
    "xo": Spec("m", 5e-6, 5e-4, "flapper to nozzle gap at null"),
    "Kbuse": Spec("m/s/Pa^0.5", 5e-3, 0.2, "nozzle flow coefficient"),
    "K1": Spec(ORIFICE, 1e-11, 1e-6, "fixed orifice of the first stage"),
    "Kf2": Spec(ORIFICE, 0.0, 1e-8, "leak from supply past the pilot spool"),
    "Vo2": Spec("m^3", 1e-10, 1e-5, "volume of a nozzle chamber at null"),
    "S2": Spec("m^2", 1e-6, 1e-3, "end area of the pilot spool"),
    "J": Spec("kg m^2", 1e-9, 1e-4, "inertia of the torque motor's armature"),
    "phi": Spec("N m s/rad", 0.0, 0.1, "damping of the armature"),
    "Kr2": Spec("N/m", 0.0, 1e5, "stiffness of the feedback spring at the spool"),
    "M2": Spec("kg", 1e-4, 1.0, "mass of the pilot spool"),
    "psi2": Spec("N s/m", 0.0, 1e3, "viscous friction of the pilot spool"),
    "K2": Spec(GRADIENT, 1e-6, 0.05, "flow gradient of the pilot lands"),
    "z2max": Spec("m", 1e-5, 5e-3, "travel of the pilot spool to its stop"),
    "Kf3": Spec(ORIFICE, 0.0, 1e-8, "leak from supply past the main spool into an end chamber"),
    "S3": Spec("m^2", 1e-5, 0.05, "end area of the main spool"),
    "Vo3": Spec("m^3", 1e-8, 1e-3, "volume of a main-spool end chamber at null"),
    "M3": Spec("kg", 1e-3, 20.0, "mass of the main spool"),
    "psi3": Spec("N s/m", 0.0, 1e5, "viscous friction of the main spool"),
    "Km": Spec("N m/A", 1e-3, 50.0, "torque-motor gain"),
    "Knet": Spec("N m/rad", -50.0, 50.0, "net stiffness of the armature: flexure less magnetic"),
    "kstop": Spec("N/m", 0.0, 1e7, "stiffness of the flapper on a closed nozzle"),
    "cff2": Spec("N/(m Pa)", 0.0, 1.0, "flow force of the pilot spool per opening and pressure drop"),
    "rff3": Spec("N s/(m^3 Pa^0.5)", 0.0, 1e4, "flow force of the main spool, per flow gradient K3"),
    "Fs1": Spec("N m", 0.0, 0.1, "Coulomb friction of the armature"),
    "Fs2": Spec("N", 0.0, 100.0, "Coulomb friction of the pilot spool"),
    "Fs3": Spec("N", 0.0, 1e4, "Coulomb friction of the main spool"),
    "k2stop": Spec("N/m", 1e6, 1e10, "stiffness of the pilot-spool stop"),
    "k3stop": Spec("N/m", 1e6, 1e11, "stiffness of the main-spool stop"),
    "z3over": Spec("1", 1.0, 3.0, "main-spool stop over travel at full command"),
    "imax": Spec("A", 1e-3, 10.0, "rated current"),
    "isat": Spec("1", 0.1, 5.0, "current limit over rated current"),
    "Kp": Spec("1", 1e-3, 100.0, "proportional gain of the spool loop"),
    **MAIN_LANDS,
}
_CORRECTORS = {
    "p": {},
    "p-lead": {"Td": Spec("s", 0.0, 0.1, "lead time of the spool loop"), "tf": Spec("s", 1e-5, 0.1, "its filter")},
    "pi-lead": {
        "Ti": Spec("s", 1e-4, 100.0, "integral time of the spool loop"),
        "Td": Spec("s", 0.0, 0.1, "lead time of the spool loop"),
        "tf": Spec("s", 1e-5, 0.1, "filter of the lead"),
    },
}
_FIGURES = {
    **RATED,
    "pilot_flow": Spec("m^3/s", 1e-8, 0.1, "flow of the pilot stage at rated current, over the same drop"),
    "imax": _NUMBERS["imax"],
}
THREE_STAGE = ValveKind(
    name="three-stage",
    numbers=_NUMBERS,
    correctors=_CORRECTORS,
    slots=(*SLOTS, "corrector", "current", "motor_current", "main_friction"),
    stages=("pilot", "main"),
    figures=_FIGURES,
    needs_geometry=True,
)
