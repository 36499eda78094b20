"""What is left of sheets, learned as one linear element in series with the model: a delay, a pole, a zero, a pair.

With the relative frequency u = f/f0 its response is

    delay     exp(-2 pi i f T)                              a pole with a zero     (1 + i f/fz)/(1 + i f/fp)
    pole      1/(1 + i u)                                   pair                   1/(1 - u^2 + 2 i zeta u)
    zero      1 + i u

(Franklin, Powell, Emami-Naeini, Feedback Control of Dynamic Systems, sec. 6.1). It stands for no part of a rig:
a zero says that the model has a pole too many, or one that is too slow.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ...base.gain_phase import gain_db
from ...records.sheet_points import SheetPoints
from ..fit.determined import FreeParameter

_F = (1.0, 3000.0)  # Hz: where a pole of what is left may be
_STARTS = 12  # frequencies from which a fit may start


@dataclass(frozen=True)
class ElementNumber:
    """A number of an element, SI: where it may be, where a fit may start, and the unit that it is shown in."""

    name: str
    unit: str
    low: float
    high: float
    tried: tuple[float, ...]

    @property
    def free(self) -> FreeParameter:
        """The free parameter that a fit moves, by its logarithm."""
        return FreeParameter(f"learned.{self.name}", self.tried[0], self.low, self.high, None, "range of the element")


@dataclass(frozen=True)
class Element:
    """A linear element in series: its words, its numbers, and its response [lanes, k] at f [k] with numbers [lanes, n].

    One lane is one set of numbers.
    """

    name: str
    numbers: tuple[ElementNumber, ...]
    response: Callable[[np.ndarray, np.ndarray], np.ndarray]

    def deviations(self, sheets: Sequence[SheetPoints], numbers: np.ndarray) -> list[np.ndarray]:
        """What it adds to every sheet [lanes, k, 2], dB and degrees (in half a turn)."""
        responses = [self.response(sheet.f, numbers) for sheet in sheets]
        return [np.stack((gain_db(h), np.degrees(np.angle(h))), axis=-1) for h in responses]

    def trials(self) -> np.ndarray:
        """Numbers [trials, n] from which a fit may start."""
        return np.array(list(product(*(number.tried for number in self.numbers))))

    def shown(self, values: Mapping[str, float]) -> str:
        """In words: "pair with f 52.1 Hz, zeta 0.4"."""
        said = [f"{n.name} {values[f'learned.{n.name}']:.3g} {n.unit}".strip() for n in self.numbers]
        return f"{self.name} with {', '.join(said)}"


def _frequency(name: str) -> ElementNumber:
    return ElementNumber(name, "Hz", *_F, tuple(np.geomspace(2.0, 1000.0, _STARTS).tolist()))


def _delay(f: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    return np.exp(-2j * np.pi * f * numbers[:, :1])


def _pole(f: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    return 1 / (1 + 1j * f / numbers[:, :1])


def _zero(f: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    return 1 + 1j * f / numbers[:, :1]


def _pole_and_zero(f: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    return (1 + 1j * f / numbers[:, 1:]) / (1 + 1j * f / numbers[:, :1])


def _pair(f: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    u = f / numbers[:, :1]
    return 1 / (1 - u**2 + 2j * numbers[:, 1:] * u)


ELEMENTS = (
    Element("delay", (ElementNumber("T", "s", 1e-5, 0.1, tuple(np.geomspace(1e-4, 1e-2, _STARTS).tolist())),), _delay),
    Element("pole", (_frequency("fp"),), _pole),
    Element("zero", (_frequency("fz"),), _zero),
    Element("pole with a zero", (_frequency("fp"), _frequency("fz")), _pole_and_zero),
    Element("pair of poles", (_frequency("f0"), ElementNumber("zeta", "", 0.02, 3.0, (0.1, 0.3, 0.7))), _pair),
)
"""From the fewest numbers on."""
