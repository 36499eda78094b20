"""What the oil of a rig is where its file does not say: its gas, its vapour, and where the one leaves it."""

ATMOSPHERE = 1.013e5  # Pa: at which oil in an open tank is saturated with gas
GAS_CONTENT = 0.09  # gas at 1 atm per volume of oil: mineral oil dissolves 7 to 10 % (Bunsen coefficient of air)
VAPOUR_PRESSURE = 100.0  # Pa: mineral oil, below 1 mbar up to 80 degC
CAVITATES = ATMOSPHERE - 1e3
"""Pressure [Pa, absolute] below which gas has come out of the oil."""


def saturation(returned: float) -> float:
    """The pressure [Pa] below which gas comes out, as a rig counts it.

    A return below 1 atm is none of an open tank: all pressures of such a rig are taken as measured from there.
    """
    return min(ATMOSPHERE, returned)
