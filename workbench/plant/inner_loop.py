"""An inner loop in the graph of a plant: what its reference makes of the command of the valve.

    u = sat(w),  T w' = K e + i + K Tv r' - K Td y' - Kp (pa - pb) - w,  i' = K e/Ti,  e = r - y

with the reference r, late by the loop's delay, and y the position, or the force at the specimen, that it controls. What
an effect does to a recorded channel, the loop does not see. The rate of the reference is that of r through a lag of
2 ms, and Td is of a position alone.
"""

import casadi as ca

from ..rigs.inner_loop import GAIN, POSITION, InnerLoop
from .assembly import Assembly

_RATE_LAG = 2e-3  # s


def valve_command(
    b: Assembly, loop: InnerLoop, command: ca.SX, controlled: ca.SX, rate: ca.SX, load_pressure: ca.SX
) -> ca.SX:
    """The command [1] of the valve for the rig's `command` [1], which is the reference over `full_command`.

    `controlled` is the position [m] with its `rate` [m/s], or the force [N]; `load_pressure` is pa - pb [Pa].
    """
    reference = command * loop.full_command
    if loop.controls == POSITION:
        b.asked = loop.full_command
    error = reference - controlled
    asked = b[GAIN] * error
    if "loop_integral_time" in b:
        integral = b.state("loop_integral", "1", 0.1)
        b.rate("loop_integral", b[GAIN] * error / b["loop_integral_time"])
        asked += integral
    if "loop_feed_forward" in b:
        followed = b.state("loop_reference", "m" if loop.controls == POSITION else "N", loop.full_command)
        reference_rate = (reference - followed) / _RATE_LAG
        b.rate("loop_reference", reference_rate)
        asked += b[GAIN] * b["loop_feed_forward"] * reference_rate
    if "loop_derivative_time" in b:
        asked -= b[GAIN] * b["loop_derivative_time"] * rate
    if "loop_pressure_feedback" in b:
        asked -= b["loop_pressure_feedback"] * load_pressure
    if "loop_lag" in b:
        lagging = b.state("loop_output", "1", 1.0)
        b.rate("loop_output", (asked - lagging) / b["loop_lag"])
        asked = lagging
    return ca.fmax(ca.fmin(asked, 1), -1)
