"""CRONE, second generation: an open loop of constant phase about the crossover, whatever the jack's own phase does."""

from dataclasses import dataclass

import numpy as np

from workbench.controller import number
from workbench.fractional import (
    ErrorLaw,
    Factors,
    JackModel,
    band,
    gain_for,
    integral,
    order_for,
    pair,
    sections_response,
    tustin,
)

CELLS = 5
_OCTAVES = np.linspace(-1, 1, 9)  # about the crossover: there the phase should be constant
_MIDDLE = len(_OCTAVES) // 2
_NEVER = 1e3  # rad^2: more than any phase is off


class Crone2(ErrorLaw):
    """C = beta/G: beta(s) = K/s ((1 + s/wh)/(1 + s/wl))^(n - 1) / (roll-off), G the jack's model without its delay.

    The order n gives the phase margin, K the crossover; the band from wl to wh is the one with which the phase of the
    whole loop, delay and roll-off included, is flattest within an octave of the crossover, so that a gain which changes
    leaves the loop's resonance as it is (Oustaloup, Mathieu, Lanusse, European Journal of Control 1(2), 1995). The law
    cancels the modes of its model: give it a jack that pressure feedback damps, not a sharp mode that a mass moves.
    """

    @dataclass(frozen=True)
    class Design(JackModel):
        """Design numbers: the jack's model, and what the loop should do on it."""

        crossover: float = number("Hz", 0.01, 100.0, "where the open loop has gain 1", 5.0)
        phase_margin: float = number("rad", 0.2, 2.0, "phase margin there and an octave around", 1.0)
        roll_off: float = number("Hz", 1.0, 400.0, "four Butterworth poles there end the law", 150.0)
        integral: float = number("Hz", 0.0, 100.0, "corner of an integrator; 0: none, the jack integrates", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        d = design
        inverse = Factors(d.modes, np.append(*(pair(d.roll_off, np.sin(np.pi / 8 * k)) for k in (1, 3))))
        ahead, integrator = tustin(inverse, period, d.crossover), integral(d.integral, period)
        low, high = _flattest(d, np.vstack((ahead, integrator)), period)

        def memory(order: float) -> np.ndarray:
            return np.vstack((tustin(band(order, low, high, CELLS), period, d.crossover), integrator))

        law = memory(order_for(lambda n: np.vstack((ahead, memory(n))), d, d.crossover, d.phase_margin, period))
        gain = gain_for(np.vstack((ahead, law)), d, d.crossover, period)
        super().__init__(np.vstack((gain, ahead)), law, period)


def _flattest(design: Crone2.Design, rest: np.ndarray, period: float) -> tuple[float, float]:
    """The band [Hz] whose fractional order, with the rest of the loop, is nearest to a constant phase: by a grid."""
    f = design.crossover * 2.0**_OCTAVES
    loop = design.response(f) * sections_response(rest, f, period)
    lacking = -np.angle(-loop * np.exp(-1j * design.phase_margin))
    low, width = design.crossover * np.geomspace(0.01, 1, 60), np.geomspace(2, 1000, 40)
    low, width = (grid.ravel()[:, None] for grid in np.meshgrid(low, width))
    turn = np.arctan(f / low) - np.arctan(f / (low * width))
    order = lacking[_MIDDLE] / turn[:, [_MIDDLE]]
    uneven = np.sum((lacking - order * turn) ** 2, axis=1) + (np.abs(order[:, 0]) > 1) * _NEVER
    best = int(np.argmin(uneven))
    return float(low[best, 0]), float((low * width)[best, 0])
