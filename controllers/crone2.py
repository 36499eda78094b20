"""CRONE, second generation: an open loop of constant phase about the crossover, whatever the jack's own phase does."""

from workbench.control.crone.template import CroneTemplateController
from workbench.control.jack_model import JackModel
from workbench.control.protocol import design_numbers, number


class Crone2(CroneTemplateController):
    """An open loop (wcg/s)^n about the crossover: a gain that changes leaves the loop's resonance as it is.

    C is the template over the jack's model (Oustaloup, Mathieu, Lanusse, European Journal of Control 1(2), 1995; the
    law is that of CroneTemplateController). It cancels the modes of its model: give it a jack that pressure feedback
    damps, not a sharp mode that a mass moves.
    """

    @design_numbers
    class Design(JackModel):
        """Design numbers: the jack's model, and what the loop should do on it."""

        crossover: float = number("Hz", 0.01, 100.0, "where the open loop has gain 1", 5.0)
        phase_margin: float = number("rad", 0.2, 2.0, "phase margin there and an octave around", 1.0)
        roll_off: float = number("Hz", 1.0, 400.0, "four Butterworth poles there end the law", 150.0)
        integral: float = number("Hz", 0.0, 100.0, "corner of an integrator; 0: none, the jack integrates", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        d = design
        super().__init__(d, period, d.crossover, d.phase_margin, d.roll_off, d.integral)
