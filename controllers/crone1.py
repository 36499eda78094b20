"""CRONE, first generation: a fractional order about the crossover, and so a constant phase of the controller there."""

from functools import lru_cache

import numpy as np

from workbench.control.crone.oustaloup import band
from workbench.control.crone.template import DesignPlant, gain_for, order_for
from workbench.control.jack_model import JackModel
from workbench.control.protocol import design_numbers, number
from workbench.control.second_order_sections import Factors, SectionController, integral, tustin

CELLS = 5


@design_numbers
class ConstantPhase:
    """What the loop should do on its plant."""

    crossover: float = number("Hz", 0.01, 100.0, "where the open loop has gain 1", 5.0)
    phase_margin: float = number("rad", 0.2, 2.0, "phase margin there", 1.0)
    span: float = number("1", 2.0, 1e4, "wh/wl: the band of the fractional order", 100.0)
    integral: float = number("Hz", 0.0, 100.0, "wi, the integrator's corner; 0: none, the jack integrates", 0.0)
    low_pass: float = number("Hz", 1.0, 1e3, "wf, the corner of the low-pass", 150.0)


class Crone1(SectionController):
    """C(s) = K (1 + wi/s) ((1 + s/wl)/(1 + s/wh))^n / (1 + s/wf), wl and wh about the crossover.

    n gives the phase margin, K the crossover, both on the jack's model (Oustaloup, La commande CRONE, 1991; Sabatier,
    Lanusse, Melchior, Oustaloup, Fractional Order Differentiation and Robust Control Design, 2015). The margin stays
    under a change of gain as far as the jack's own phase is constant there; where it is not, take crone2.
    """

    @design_numbers
    class Design(ConstantPhase, JackModel):
        """Design numbers: the jack's model, and what the loop should do on it."""

    def __init__(self, design: Design, period: float) -> None:
        super().__init__(*constant_phase(design, design, period), period)


@lru_cache(maxsize=16)
def constant_phase(d: ConstantPhase, plant: DesignPlant, period: float) -> tuple[np.ndarray, np.ndarray]:
    """What is fast and what would wind up, as sections; a study builds the same controller for each of its loops."""
    low = d.crossover / np.sqrt(d.span)
    end = tustin(Factors(np.array([]), np.array([-2 * np.pi * d.low_pass])), period, d.crossover)

    def memory(order: float) -> np.ndarray:
        about = tustin(band(order, low, low * d.span, CELLS), period, d.crossover)
        return np.vstack((about, integral(d.integral, period)))

    law = memory(order_for(lambda n: np.vstack((end, memory(n))), plant, d.crossover, d.phase_margin, period))
    gain = gain_for(np.vstack((end, law)), plant, d.crossover, period)
    return np.vstack((gain, end)), law
