"""Laws that meet a crossover and a phase margin on a plant: the order gives the phase, the gain the crossover; and the
abstract CRONE law of an open-loop template: the phase about the crossover is given, not the plant's.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Protocol, cast

import numpy as np

from ...base.errors import InputError
from ...linear.interconnect import feedback
from ...linear.state_space import StateSpace
from ..second_order_sections import (
    Factors,
    SectionController,
    integral,
    pair,
    sections_response,
    sections_system,
    tustin,
)
from .oustaloup import band

Law = Callable[[float], np.ndarray]  # sections of gain 1 for an order
CELLS = 5
_OCTAVES = np.linspace(-1, 1, 9)  # about the crossover: there the phase should be the template's
_MIDDLE = len(_OCTAVES) // 2
_NEVER = 1e3  # rad^2: more than any phase is off


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

    def discretise(self, period: float) -> StateSpace:
        """command -> position [m], held over each `period` [s]."""
        ...


def order_for(law: Law, plant: DesignPlant, crossover: float, margin: float, period: float) -> float:
    """The order of `law` at which its loop has the phase `margin` [rad] - pi at `crossover` [Hz].

    Raises InputError, saying what can be had, where no order between -1 and 1 does.
    """
    f = np.array([crossover])
    plain = sections_response(law(0.0), f, period)
    missing = np.angle(-np.exp(-1j * margin) * plant.response(f) * plain)[0]

    def over(order: float) -> float:
        """Phase [rad] above the wanted one."""
        return float(missing + np.angle(sections_response(law(order), f, period) / plain)[0])

    least, largest = over(-1.0), over(1.0)
    if not least < 0 < largest:
        low, high = np.degrees(np.array([least, largest]) + margin)
        raise InputError(
            f"a phase margin of {np.degrees(margin):.0f} deg at {crossover:g} Hz is out of reach: {low:.0f} to "
            f"{high:.0f} deg can be reached there; ask for that, or move the crossover"
        )
    from scipy.optimize import brentq

    return cast(float, brentq(over, -1.0, 1.0))


def gain_for(sections: np.ndarray, plant: DesignPlant, crossover: float, period: float) -> np.ndarray:
    """One section [1, 6]: the gain at which a loop of `sections` crosses over at `crossover` [Hz].

    Raises InputError where that loop is unstable on the plant itself.
    """
    f = np.array([crossover])
    gain = float(1 / np.abs(plant.response(f) * sections_response(sections, f, period))[0])
    factor = np.array([[gain, 0, 0, 1, 0, 0]])
    law = sections_system(np.vstack((factor, sections)), period)
    back = replace(law, C=-law.C, D=-law.D).relabelled(["position"], ["command"])
    if not np.abs(feedback(plant.discretise(period), back).poles()).max() < 1 - 1e-9:
        raise InputError(f"a loop with this phase at {crossover:g} Hz is unstable; lower the crossover")
    return factor


class CroneTemplateController(SectionController):
    """C = beta/G: beta(s) = K/s ((1 + s/wh)/(1 + s/wl))^(n - 1) / (roll-off), G the poles and zeros of the plant that a
    law may cancel, its integrators among them; of a jack all but its delay.

    The order n gives the phase `margin` [rad], K the crossover [Hz]; wl and wh are those with which the phase of the
    whole loop, delay and roll-off included, is nearest to a template's within an octave of the crossover: the phase
    Re/i (wcg/s)^(a + i b) has there, constant for b = 0. Butterworth poles, of a jack four, end the law at `roll_off`
    [Hz]; an `integrator` has its corner [Hz] there, none at 0. Raises InputError for what is out of reach.
    """

    def __init__(
        self,
        plant: DesignPlant,
        period: float,
        crossover: float,
        margin: float,
        roll_off: float,
        integrator: float,
        b: float = 0.0,
    ) -> None:
        super().__init__(*_designed(plant, period, crossover, margin, roll_off, integrator, b), period)


@lru_cache(maxsize=16)
def _designed(
    plant: DesignPlant, period: float, crossover: float, margin: float, roll_off: float, integrator: float, b: float
) -> tuple[np.ndarray, np.ndarray]:
    """What is fast and what would wind up, as sections; a study builds the same controller for each of its loops."""
    ending = np.append(plant.zeros, _butterworth(roll_off, len(plant.modes) - len(plant.zeros)))
    ahead = tustin(Factors(plant.modes, ending), period, crossover)
    slow = np.vstack((integral(integrator, period), _accumulator(plant, period)))
    f = crossover * 2.0**_OCTAVES
    rest = plant.response(f) * sections_response(np.vstack((ahead, slow)), f, period)
    lacking = template_phase(f / crossover, b) - np.angle(-rest * np.exp(-1j * margin))
    low, high = _nearest_band(f, lacking)

    def memory(order: float) -> np.ndarray:
        return np.vstack((tustin(band(order, low, high, CELLS), period, crossover), slow))

    law = memory(order_for(lambda n: np.vstack((ahead, memory(n))), plant, crossover, margin, period))
    return np.vstack((gain_for(np.vstack((ahead, law)), plant, crossover, period), ahead)), law


def _butterworth(roll_off: float, least: int) -> np.ndarray:
    """Poles [rad/s] at `roll_off` [Hz]: two, or as many pairs as it takes for `least` poles."""
    order = 2 * max(1, -(-least // 2))
    return np.concatenate([pair(roll_off, np.sin(k * np.pi / (2 * order))) for k in range(1, order, 2)])


def _accumulator(plant: DesignPlant, period: float) -> np.ndarray:
    """A section [1, 6] that integrates, its zero at 0 so that it can be inverted; none [0, 6] where the plant does."""
    return np.array([[period, 0.0, 0.0, 1.0, -1.0, 0.0]])[: int(not plant.integrators)]


def template_phase(ratio: np.ndarray, b: float) -> np.ndarray:
    """Phase [rad] of a complex order's template at w/wcg [k], less that at wcg, |b| < 2.

    beta = (cosh(b pi/2))^sign(b) (wcg/s)^a (Re/i (wcg/s)^(i b))^-sign(b) (Oustaloup, Mathieu, Lanusse, European Journal
    of Control 1(2), 1995): with s = j w its phase is sign(b) atan(tan(b ln(w/wcg)) tanh(b pi/2)) above -a pi/2.
    """
    return np.sign(b) * np.arctan(np.tan(b * np.log(ratio)) * np.tanh(b * np.pi / 2))


def _nearest_band(f: np.ndarray, lacking: np.ndarray) -> tuple[float, float]:
    """The band [Hz] whose power is nearest to a phase [k] at f, and is that in its middle: by a grid."""
    low, width = f[_MIDDLE] * np.geomspace(0.01, 1, 60), np.geomspace(2, 1000, 40)
    low, width = (grid.ravel()[:, None] for grid in np.meshgrid(low, width))
    turn = np.arctan(f / low) - np.arctan(f / (low * width))
    order = lacking[_MIDDLE] / turn[:, [_MIDDLE]]
    uneven = np.sum((lacking - order * turn) ** 2, axis=1) + (np.abs(order[:, 0]) > 1) * _NEVER
    best = int(np.argmin(uneven))
    return float(low[best, 0]), float((low * width)[best, 0])
