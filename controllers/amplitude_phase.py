"""Amplitude and phase control: what a loop is given to follow so that its position is the sine that is asked for."""

from typing import ClassVar, Literal

import numpy as np

from workbench.control.protocol import design_numbers, number
from workbench.control.sine_control import SineControl


class AmplitudePhase:
    """r' = Re(G z + c3 z^3/|z|^2 + c5 z^5/|z|^4): sines of one frequency arrive as they are asked for.

    z is the reference with its quarter lag. G, c3 and c5 are learned block by block from the measured position: see
    workbench.control.sine_control. `gain` and `phase` of the loop at the frequency are where G starts; those at its
    harmonics are what c3 and c5 are corrected by, and a harmonic without them is left alone. The loop's margins stay
    as they are: between blocks nothing measured goes into the reference.
    """

    into: ClassVar[Literal["graph"]] = "graph"

    @design_numbers
    class Design:
        """Design numbers."""

        frequency: float = number("Hz", 1e-3, 1e3, "frequency of the sines")
        gain: float = number("1", 1e-3, 1e3, "gain of the loop at the frequency", 1.0)
        phase: float = number("deg", -360.0, 360.0, "phase of the loop at the frequency", 0.0)
        gain3: float = number("1", 0.0, 1e3, "gain at three times the frequency; 0: the harmonic is left alone", 0.0)
        phase3: float = number("deg", -360.0, 360.0, "phase at three times the frequency", 0.0)
        gain5: float = number("1", 0.0, 1e3, "gain at five times the frequency; 0: the harmonic is left alone", 0.0)
        phase5: float = number("deg", -360.0, 360.0, "phase at five times the frequency", 0.0)
        settle: float = number("s", 0.0, 60.0, "given to the loop before it is measured", 0.05)
        measure: float = number("s", 0.0, 60.0, "measured at least, in whole cycles", 0.05)
        noise: float = number("m", 0.0, 1.0, "standard deviation of the position sensor", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        d = design
        pairs = [(d.gain, d.phase), (d.gain3, d.phase3), (d.gain5, d.phase5)]
        size = next((i for i, (gain, _) in enumerate(pairs) if not gain), len(pairs))
        responses = tuple(gain * np.exp(1j * np.radians(phase)) for gain, phase in pairs[:size])
        self.shell = SineControl(d.frequency, responses, d.settle, d.measure, d.noise, period)
