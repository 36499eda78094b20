"""CRONE, second and third generation, on any linear plant."""

from typing import ClassVar

from workbench.control.crone.template import CroneTemplateController
from workbench.control.linear_model import LinearModel
from workbench.control.protocol import design_numbers, number
from workbench.rigs.linear_rig import LinearRig


class LinearCrone(CroneTemplateController):
    """An open loop of given phase about the crossover on the loop's own plant: crone2, or crone3 with an `imaginary`.

    The law cancels the plant's stable poles and damped zeros, up to a quarter of the sampling frequency, and has an
    integrator where the plant has none; what it does not cancel, and the delay, count in the phase.
    """

    of_linear_plants: ClassVar[bool] = True

    @design_numbers
    class Design:
        """Design numbers: what the loop should do on the plant."""

        crossover: float = number("Hz", 1e-3, 1e3, "where the open loop has gain 1")
        phase_margin: float = number("rad", 0.2, 2.0, "phase margin there and an octave around", 1.0)
        roll_off: float = number("Hz", 1e-2, 1e4, "Butterworth poles there end the law", 150.0)
        integral: float = number("Hz", 0.0, 100.0, "corner of a further integrator; 0: none", 0.0)
        imaginary: float = number("1", -1.9, 1.9, "b, the imaginary order; 0: crone2", 0.0)

    def __init__(self, design: Design, period: float, plant: LinearRig) -> None:
        d, model = design, LinearModel(plant, period)
        super().__init__(model, period, d.crossover, d.phase_margin, d.roll_off, d.integral, d.imaginary)
