"""Laws that meet a crossover and a phase margin on a plant: the order gives the phase, the gain the crossover."""

from collections.abc import Callable
from typing import Protocol, cast

import numpy as np

from ...base.errors import InputError
from ...linear.state_space import StateSpace
from ..second_order_sections import sections_response, sections_system

Law = Callable[[float], np.ndarray]  # sections of gain 1 for an order


class DesignPlant(Protocol):
    """A plant from command to position, as a sampled loop sees it."""

    @property
    def modes(self) -> np.ndarray:
        """Poles [rad/s] that a law cancels."""
        ...

    @property
    def zeros(self) -> np.ndarray:
        """Zeros [rad/s] that a law cancels."""
        ...

    @property
    def integrators(self) -> int:
        """How many poles are 0."""
        ...

    def response(self, f: np.ndarray) -> np.ndarray:
        """position/command at f [k] in Hz, complex [k] in m."""
        ...

    def stable(self, law: StateSpace) -> bool:
        """Whether the loop of a discrete law (error -> command) on it is stable."""
        ...


def order_for(law: Law, plant: DesignPlant, crossover: float, margin: float, period: float, most: float = 1.0) -> float:
    """The order of `law` at which its loop has the phase `margin` [rad] - pi at `crossover` [Hz].

    Raises InputError, saying what can be had, where no order between -most and most does.
    """
    f = np.array([crossover])
    plain = sections_response(law(0.0), f, period)
    missing = np.angle(-np.exp(-1j * margin) * plant.response(f) * plain)[0]

    def over(order: float) -> float:
        """Phase [rad] above the wanted one."""
        return float(missing + np.angle(sections_response(law(order), f, period) / plain)[0])

    least, largest = over(-most), over(most)
    if not least < 0 < largest:
        low, high = np.degrees(np.array([least, largest]) + margin)
        raise InputError(
            f"a phase margin of {np.degrees(margin):.0f} deg at {crossover:g} Hz is out of reach: {low:.0f} to "
            f"{high:.0f} deg can be reached there; ask for that, or move the crossover"
        )
    from scipy.optimize import brentq

    return cast(float, brentq(over, -most, most))


def gain_for(sections: np.ndarray, plant: DesignPlant, crossover: float, period: float) -> np.ndarray:
    """One section [1, 6]: the gain at which a loop of `sections` crosses over at `crossover` [Hz].

    Raises InputError where that loop is unstable on the plant itself.
    """
    f = np.array([crossover])
    gain = float(1 / np.abs(plant.response(f) * sections_response(sections, f, period))[0])
    factor = np.array([[gain, 0, 0, 1, 0, 0]])
    if not plant.stable(sections_system(np.vstack((factor, sections)), period)):
        raise InputError(f"a loop with this phase at {crossover:g} Hz is unstable; lower the crossover")
    return factor
