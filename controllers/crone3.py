"""CRONE, third generation: an open loop of complex order, its phase turning about the crossover as a plant set asks."""

from dataclasses import replace

import numpy as np

from workbench.base.errors import InputError
from workbench.control.crone.template import CroneTemplateController
from workbench.control.inner_loop import peak
from workbench.control.protocol import design_numbers, number
from workbench.linear.state_space import StateSpace

from .crone2 import Crone2

_STEEPEST, _STEPS = 0.9, 37  # of b in a search: the phase turns by 45 degrees an octave


class Crone3(CroneTemplateController):
    """An open loop Re/i (wcg/s)^(a + i b) about the crossover: the phase margin gives a, b turns the phase.

    With b > 0 the phase rises with frequency, with b < 0 it falls, by b tanh(|b| pi/2) for a factor e; b = 0 is crone2.
    Which b serves a set of jacks best, `least_peak` finds (Oustaloup, Mathieu, Lanusse, European Journal of Control
    1(2), 1995). The one band of a CroneTemplateController follows the template to some 15 degrees an octave.
    """

    @design_numbers
    class Design(Crone2.Design):
        """Design numbers: those of crone2, and the imaginary order."""

        imaginary: float = number("1", -1.9, 1.9, "b, the imaginary order", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        d = design
        super().__init__(d, period, d.crossover, d.phase_margin, d.roll_off, d.integral, d.imaginary)


def least_peak(design: Crone3.Design, jacks: list[StateSpace], period: float) -> Crone3.Design:
    """The design with the b, of a fine grid, whose largest resonance peak over a set of sampled jacks is least.

    Crossover and phase margin on the design's own model stay. Raises InputError where no b is stable on all of them.
    """
    designs = [replace(design, imaginary=float(b)) for b in np.linspace(-_STEEPEST, _STEEPEST, _STEPS)]
    peaks = [_worst(each, jacks, period) for each in designs]
    best = int(np.argmin(peaks))
    if not np.isfinite(peaks[best]):
        raise InputError(f"no loop at {design.crossover:g} Hz is stable on all of these jacks; lower the crossover")
    return designs[best]


def _worst(design: Crone3.Design, jacks: list[StateSpace], period: float) -> float:
    try:
        law = Crone3(design, period).linear()
    except InputError:
        return np.inf
    return max(peak(jack, law) for jack in jacks)
