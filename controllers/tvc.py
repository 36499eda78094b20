"""Three-variable control of test rigs: displacement, velocity and acceleration, each asked for and fed back."""

from typing import Any, ClassVar

import numpy as np

from workbench.control.law import LawController, linear_law
from workbench.control.protocol import design_numbers, number
from workbench.linear.interconnect import parallel
from workbench.linear.sampling import hold_matrices
from workbench.linear.state_space import StateSpace, state_space

_STATES = "reference", "reference_velocity", "reference_acceleration", "displacement", "velocity"


class Tvc(LawController):
    """u = kx (xr - x) + kv (vr - v) + ka (ar - a) + (vr + 2 d ar/wn)/Kv.

    A reference generator makes xr, vr, ar of the reference: a low pass 1/(s/wr + 1)^3 and its derivatives. The velocity
    comes from displacement below a crossover frequency c and from acceleration above it: x' = v + 2 c e, v' = a + c^2 e
    with e the position less x. The gains put the poles of the jack Kv wn^2/(s (s^2 + 2 d wn s + wn^2)) to one at -p and
    a mode (w, z):

        kx = p w^2/(Kv wn^2),  kv = (w^2 + 2 z w p - wn^2)/(Kv wn^2),  ka = (p + 2 z w - 2 d wn)/(Kv wn^2)

    and with the feed-forward x follows xr but for its jerk. Delta-P stabilisation is the compensator PressureFeedback;
    d then is the damping with it. Sources: Plummer, Control techniques for structural testing: a review, and Tagawa and
    Kajiwara, Controller development for the E-Defense shaking table, both Proc. IMechE I 221(2), 2007.
    """

    measures: ClassVar[tuple[str, ...]] = ("position", "acceleration")

    @design_numbers
    class Design:
        """Design numbers: what the loop should be, and the jack, which `jackbench show` gives."""

        bandwidth: float = number("Hz", 0.01, 100.0, "pole p of the closed loop")
        mode_frequency: float = number("Hz", 0.1, 1e3, "natural frequency w of its mode")
        mode_damping: float = number("1", 0.01, 2.0, "damping z of its mode")
        velocity_gain: float = number("m/s", 1e-3, 1e3, "speed of the jack per unit of command Kv")
        jack_frequency: float = number("Hz", 0.1, 1e3, "natural frequency wn of the mass on the oil")
        jack_damping: float = number("1", 0.0, 2.0, "damping d of the mass on the oil")
        reference_corner: float = number("Hz", 0.1, 1e3, "corner wr of the reference generator")
        crossover: float = number("Hz", 0.1, 1e3, "where velocity is taken from acceleration rather than displacement")

    def __init__(self, design: Design, period: float) -> None:
        a, b, c, d = _system(design, period).matrices
        super().__init__(linear_law(a, b, c[0], d[0], np.zeros(len(a)), self.measures, period, names=_STATES))


def gains(design: Tvc.Design) -> tuple[float, float, float]:
    """kx [1/m], kv [s/m], ka [s^2/m]."""
    p, w, wn = (2 * np.pi * f for f in (design.bandwidth, design.mode_frequency, design.jack_frequency))
    z, d, drive = design.mode_damping, design.jack_damping, design.velocity_gain * wn**2
    return p * w**2 / drive, (w**2 + 2 * z * w * p - wn**2) / drive, (p + 2 * z * w - 2 * d * wn) / drive


def _system(design: Tvc.Design, period: float) -> StateSpace:
    """States: xr, vr, ar of the generator, then displacement and velocity of the observer."""
    kx, kv, ka = gains(design)
    forward = np.array([0.0, 1.0, 2 * design.jack_damping / (2 * np.pi * design.jack_frequency)]) / design.velocity_gain
    wr, w = 2 * np.pi * design.reference_corner, 2 * np.pi * design.crossover
    lags, kinematics = [[0, 1, 0], [0, 0, 1], [-(wr**3), -3 * wr**2, -3 * wr]], [[-2 * w, 1], [-(w**2), 0]]
    asked = [np.array([kx, kv, ka]) + forward]
    generator = _sampled(lags, [[0], [0], [wr**3]], asked, [[0.0]], period, ["reference"])
    measured = ["position", "acceleration"]
    return parallel(
        generator, _sampled(kinematics, [[2 * w, 0], [w**2, 1]], [[0.0, -kv]], [[-kx, -ka]], period, measured)
    )


def _sampled(a: Any, b: Any, c: Any, d: Any, period: float, inputs: list[str]) -> StateSpace:
    """A part of the law that gives the command, its inputs held over each `period` [s]."""
    held = hold_matrices(np.array(a, dtype=float), np.array(b, dtype=float), period)
    return state_space(*held, c, d, period, inputs, ["command"])
