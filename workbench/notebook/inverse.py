"""An inverse before a loop: what makes a drive of a reference that is known ahead."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..commands.inverse.page import gain_figure
from ..loop.designed_inverse import ReferenceInverse
from ..report import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Inverse:
    """A finite filter of the reference that undoes a closed loop: `loop.follow(inverse(reference))`.

    The reference [k] is sampled at the control period; it stands before its first sample and after its last.
    """

    design: ReferenceInverse

    def __call__(self, reference: ArrayLike) -> np.ndarray:
        """The drive [k] for a reference [k]."""
        return self.design.filtered(np.asarray(reference, float))

    def response(self, f: ArrayLike) -> np.ndarray:
        """Its response, complex [k], at frequencies f [k] Hz."""
        return self.design.response(np.asarray(f, float))

    def plot(self) -> Figure:
        """Gain and phase."""
        return gain_figure(self.design)

    def __repr__(self) -> str:
        period, taps = self.design.period * 1e3, len(self.design.taps)
        return f"inverse of {taps * period:g} ms, {self.design.preview * period:g} ms ahead"

    def _repr_html_(self) -> str:
        return self.plot()._repr_html_()
