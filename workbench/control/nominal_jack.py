"""The jack about which a position loop measures its own."""

from .protocol import design_numbers, number


@design_numbers
class NominalJack:
    """The jack about which the meter measures."""

    inertia: float = number("Pa s^2/m", 1.0, 1e9, "nominal mass over area")
    jack_frequency: float = number("Hz", 0.1, 1e3, "nominal natural frequency at mid stroke")
    velocity_gain: float = number("m/s", 1e-3, 1e3, "nominal velocity per command")
    valve_frequency: float = number("Hz", 1.0, 1e4, "natural frequency of the valve")
    valve_damping: float = number("1", 0.1, 10.0, "damping of the valve")
    reach: float = number("m", 1e-3, 100.0, "half the length of both oil columns, dead volumes included")
