"""What the legs of a platform do to each other, as a graph: all pushes accelerate each, and all brake at once.

With the inertia H [6, 6] of the legs, forces per acceleration, a platform whose legs move at v brakes along its own way
with forces H v/T, where T is the time in which it stops. The leg of which that asks most of what it has left says T.
"""

import casadi as ca

from .guard_motion import Parts, is_finite
from .guard_shape import places

LEGS = 6
COUPLED = places(inertia=LEGS**2, mobility=LEGS**2, load=LEGS, drag=LEGS, left=LEGS, least=LEGS)
_KNOWN = 0.75  # of the deceleration along its way that a payload other than the declared one is taken to leave
_STILL = 1e-9  # kg m/s: nothing to brake


def coupled(q: Parts, speeds: ca.SX, pressed: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Acceleration [6] of each leg by all pushes, and deceleration [6] of each where all brake, m/s^2, at speeds [6]
    and forces of the pressures [6]. One that is not finite counts as the load that the leg holds.

    Numbers by COUPLED: inertia and its inverse, column by column, load [N] and drag [N s/m] of each leg, what force it
    has `left` to brake, and its `least` deceleration.
    """
    inertia, mobility = (ca.reshape(q[name], LEGS, LEGS) for name in ("inertia", "mobility"))
    push = ca.if_else(is_finite(pressed), pressed - q["load"], 0) - q["drag"] * speeds
    asked = ca.fabs(inertia @ speeds)
    rate = ca.mmin(q["left"] / (asked + _STILL))
    return mobility @ push, ca.fmax(q["least"], _KNOWN * rate * ca.fabs(speeds))


def told(q: Parts, acceleration: ca.SX, braking: ca.SX) -> dict[str, ca.SX]:
    """The numbers of a leg's guard that go by what the others do, of its own ones."""
    return {"pushed": acceleration, "braking": braking, "fade": braking * q["opening"] * q["period"]}
