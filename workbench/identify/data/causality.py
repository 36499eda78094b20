"""Whether a response comes after what it answers.

The gain of a response says the least lag that it has (Bode): that of a model near it whose zeros and poles are left of
the axis. What its phase has beyond that is delay, and less than that is a lead, which nothing real has. The lag of a
servo is thus not taken for a delay, nor the lead of a spring with a damper for foresight.
"""

import numpy as np

from ...records.rational_fit import FitOrder, fit_rational
from .frequency_response import FrequencyResponse

_SURE, _FEWEST = 0.1, 8  # of the response: 95 % radius of a line that is looked at; such lines
_ORDER = FitOrder(poles=2, zeros=1, integrators=0)
_LATER = 0.5  # periods of the highest frequency: delay that is added first, as a fitted one is not negative
_NEAR = 0.1  # rms of the relative error of a model that is near enough to judge by
_LEAD = 1.5  # periods of the record by which a response leads
_CLEAR = 5.0  # the same where the output need not be an answer, such as the force of a spring on its position


def sure_lines(response: FrequencyResponse) -> tuple[np.ndarray, np.ndarray]:
    """f [k] and response [k] of the lines that say who leads; none where they are too few."""
    sure = in_band(response.f, response.radius < _SURE * np.abs(response.response))
    sure &= sure.sum() >= _FEWEST
    return response.f[sure], response.response[sure]


def in_band(f: np.ndarray, sure: np.ndarray) -> np.ndarray:
    """The `sure` lines [k] at f [k] up to where half of all are: beyond what moves some are sure by chance."""
    order = np.argsort(f)
    share = np.cumsum(sure[order]) / np.arange(1, f.size + 1)
    return sure & (f <= np.max(f[order][share >= 0.5], initial=-np.inf))


def lead_problem(response: FrequencyResponse, period: float, follows: bool = True, clear: bool = False) -> str:
    """What is wrong, in words, with a response that leads its input by rows of `period` [s]; "" where it does not.

    `follows`: the output is to come to the input, so that its phase alone may tell; `clear`: a small lead is allowed.
    """
    f, h = sure_lines(response)
    lead = _lead(f, h, follows) if f.size else 0.0
    if lead <= (_CLEAR if clear else _LEAD) * period:
        return ""
    return (
        f"{response.output} leads {response.input} by {1e3 * lead:.3g} ms, and nothing knows ahead what it follows; "
        f"exchange their columns, or, where {response.input} was logged late, move it by its logger's delay"
    )


def _lead(f: np.ndarray, h: np.ndarray, follows: bool) -> float:
    """By how much [s] a response is early: of the lag that its gain asks for; where no model of low order is near, and
    it `follows`, by the phase that rises straight with the frequency."""
    order = np.argsort(f)
    f, h = f[order], h[order]
    straight = float(np.sum(np.unwrap(np.angle(h)) * f) / np.sum(f**2) / (2 * np.pi))
    later = max(straight, 0.0) + _LATER / f[-1]
    fit = fit_rational(f, h * np.exp(-2j * np.pi * f * later), _ORDER)
    if fit.error < _NEAR:
        zeros = np.roots(fit.numerator)
        return later - fit.delay - float(np.sum(2 * np.real(1 / zeros[np.real(zeros) > 0])))
    return straight if follows else 0.0
