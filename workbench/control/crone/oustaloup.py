"""Powers of s between its integers: Oustaloup's poles and zeros, evenly spread over a logarithmic band."""

import numpy as np

from ..second_order_sections import Factors

BEYOND = 40.0  # the cells go on this far beyond a band, so that its ends are as good as its middle
CELLS = 1.25  # a decade: gain within 0.1 dB, phase within 1.5 degrees for orders of -0.9 to 0.9


def oustaloup(order: float, low: float, high: float, cells: int) -> Factors:
    """s^order by `cells` poles and zeros between `low` and `high` [Hz]; the gain is exact at their geometric centre.

    zero k, pole k = low (high/low)^((k + 1/2 -+ order/2)/cells), k = 0 ... cells - 1 (Oustaloup, Levron, Mathieu,
    Nanot, IEEE Trans. Circuits and Systems I 47(1), 2000). Outside the band it is constant. s counts in rad/s.
    """
    shaped = band(order, low, high, cells)
    centre = np.sqrt(low * high)
    gain = (2 * np.pi * centre) ** order / abs(shaped(np.array([centre]))[0])
    return Factors(shaped.zeros, shaped.poles, float(gain))


def band(order: float, low: float, high: float, cells: int) -> Factors:
    """((1 + s/wl)/(1 + s/wh))^order by the cells of `oustaloup`, with its gain of 1 at s = 0."""
    steps = np.arange(cells) + 0.5
    zeros, poles = (-2 * np.pi * low * (high / low) ** ((steps + side) / cells) for side in (-order / 2, order / 2))
    return Factors(zeros, poles)


def power(order: float, low: float, high: float) -> Factors:
    """s^order for |order| < 1, within 0.5 dB and 2 degrees everywhere between `low` and `high` [Hz]."""
    low, high = low / BEYOND, high * BEYOND
    return oustaloup(order, low, high, int(np.ceil(CELLS * np.log10(high / low))))
