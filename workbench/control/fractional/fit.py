"""A fractional system fitted to a measured frequency response."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from ...base.errors import InputError
from ...base.rational_function import fit_rational_function
from .polynomial import order_of
from .transfer_function import FractionalTransferFunction

if TYPE_CHECKING:
    from ...report.figures import Figure

_ORDERS = 0.05, 1.95  # commensurate orders that are tried
_GRID, _PHASES = 39, 6
_DIGITS = 4  # of a fitted order
_NOTHING = 1e-12  # a coefficient with such a part in all values of its polynomial is 0


@dataclass(frozen=True, eq=False)
class FractionalFit:
    """A fractional system beside the response [k] at f [k] in Hz it was fitted to, a relative one at its true phase.

    `error` is the root mean square of the relative difference.
    """

    system: FractionalTransferFunction
    f: np.ndarray
    response: np.ndarray
    error: float

    def figure(self) -> "Figure":
        """Measured and fitted response."""
        from ...report.figures import FrequencyCurve, bode

        fitted = FrequencyCurve("fitted", self.f, self.system.response(self.f))
        return bode(str(self.system), [FrequencyCurve("measured", self.f, self.response, "markers"), fitted])

    def __repr__(self) -> str:
        return f"{self.system}, within {100 * self.error:.3g} % rms from {self.f[0]:g} to {self.f[-1]:g} Hz"


def fit_fractional(
    f: np.ndarray,
    response: np.ndarray,
    zeros: int,
    poles: int,
    order: float | Fraction | None = None,
    relative: bool = False,
) -> FractionalFit:
    """b_0 + ... + b_zeros s^(zeros q) over a_0 + ... + a_poles s^(poles q), fitted to a frequency response.

    For a commensurate order q by the weighted linear least squares of Levy, repeated after Sanathanan and Koerner (IEEE
    Trans. Automatic Control 8(1), 1963; for fractional orders Valério and Sá da Costa, Signal Processing 86(10), 2006).
    Every frequency counts alike, by its relative error.

    Parameters
    ----------
    f
        Frequencies [k] in Hz, above 0.
    response
        Complex response [k], nowhere 0.
    zeros
        Degree of the numerator in s^q.
    poles
        Degree of the denominator in s^q.
    order
        q [1]; searched, to four digits, where none is given.
    relative
        Whether the response, as a FrequencySheet has it, may be turned by a constant phase, which the fit finds.

    Returns
    -------
    The system, beside the response at its true phase, with the relative error.

    Raises
    ------
    InputError
        For fewer frequencies than coefficients, or a response that vanishes.
    """
    f, response = np.asarray(f, float), np.asarray(response, complex)
    if zeros < 0 or poles < zeros:
        raise InputError(f"{zeros} zeros and {poles} poles in s^q: at least as many poles as zeros, none below 0")
    if 2 * len(f) < zeros + poles + 2 or len(f) != len(response):
        count = zeros + poles + 1
        raise InputError(f"{len(f)} frequencies and {len(response)} responses for {count} coefficients; measure more")
    if not (np.all(np.isfinite(response)) and np.all(response) and np.all(f > 0)):
        raise InputError("frequencies must be above 0, and responses finite and not 0")
    known = None if order is None else order_of(order)

    def fitted(q: float | Fraction, phase: float) -> FractionalFit:
        return _fitted(f, response * np.exp(1j * phase), zeros, poles, Fraction(q))

    if known is not None and not relative:
        return fitted(known, 0.0)
    rounded = known or Fraction(f"{_search(fitted, None, relative)[0]:.{_DIGITS}f}")
    return fitted(rounded, _search(fitted, rounded, relative)[1] if relative else 0.0)


def _search(fitted: Callable[..., FractionalFit], order: Fraction | None, relative: bool) -> tuple[float, float]:
    """Order and phase [rad] of the least error: from the best of a grid by the simplex of Nelder and Mead."""
    from scipy.optimize import minimize

    orders = np.linspace(*_ORDERS, _GRID) if order is None else np.array([float(order)])
    phases = np.linspace(-np.pi / 2, np.pi / 2, _PHASES, endpoint=False) if relative else np.zeros(1)
    grid = np.stack(np.meshgrid(orders, phases), axis=-1).reshape(-1, 2)
    free = np.array([order is None, relative])
    best = grid[int(np.argmin([fitted(*point).error for point in grid]))]

    def error(moved: np.ndarray) -> float:
        point = best.copy()
        point[free] = moved
        return np.log(fitted(*point).error + _NOTHING) if _ORDERS[0] / 2 < point[0] < 2 else np.inf

    corners = np.vstack((best[free], best[free] + 0.03 * np.eye(free.sum())))
    options = {"xatol": 1e-7, "fatol": 1e-6, "initial_simplex": corners}
    best[free] = minimize(error, best[free], method="Nelder-Mead", options=options).x
    return float(best[0]), float(best[1])


def _fitted(f: np.ndarray, response: np.ndarray, zeros: int, poles: int, order: Fraction) -> FractionalFit:
    """At one order: rational in s^order."""
    sigma = (2j * np.pi * f) ** float(order)
    found = fit_rational_function(sigma, response, zeros, poles)
    parts = _terms(found.gain, found.zeros, sigma, order), _terms(1.0, found.poles, sigma, order)
    return FractionalFit(FractionalTransferFunction.of(*parts), f, response, found.error)


def _terms(leading: float, roots: np.ndarray, sigma: np.ndarray, order: Fraction) -> list[tuple[Fraction, float]]:
    """Orders and coefficients of a polynomial in s^order; one that is nothing in its values [k] at sigma [k] is 0."""
    numbers = leading * np.real(np.atleast_1d(np.poly(roots)))[::-1]
    values = np.abs(numbers * sigma[:, None] ** np.arange(len(numbers)))
    share = np.linalg.norm(values / np.abs(np.prod(sigma[:, None] - roots, axis=1) * leading)[:, None], axis=0)
    numbers = np.where(share < _NOTHING, 0.0, numbers)
    return [(order * k, float(number)) for k, number in enumerate(numbers)]


def fit_orders(f: np.ndarray, response: np.ndarray, start: FractionalTransferFunction) -> FractionalFit:
    """Every coefficient and every order above 0 of `start` moved to bring it near to a response [k] at f [k] in Hz.

    By nonlinear least squares of ln(G/response), so that every frequency counts alike; signs stay, and so do the
    leading coefficient below and a delay. Orders come out with four digits, and need no commensurate order. Raises
    InputError for fewer frequencies than numbers to be found.
    """
    from scipy.optimize import least_squares

    f, response = np.asarray(f, float), np.asarray(response, complex)
    s = 2j * np.pi * f

    def system(numbers: np.ndarray) -> FractionalTransferFunction:
        return _moved(start, numbers[:count], numbers[count:])

    def difference(numbers: np.ndarray) -> np.ndarray:
        ratio = np.log(system(numbers)(s) / response)
        return np.concatenate((np.real(ratio), np.imag(ratio)))

    orders = np.concatenate([part.orders[part.orders > 0] for part in (start.numerator, start.denominator)])
    count = len(start.numerator.terms) + len(start.denominator.terms) - 1
    if 2 * len(f) < count + len(orders):
        raise InputError(f"{len(f)} frequencies for {count} coefficients and {len(orders)} orders; measure more")
    free = least_squares(difference, np.append(np.zeros(count), orders), x_scale="jac").x
    rounded = np.round(free[count:], _DIGITS)
    last = least_squares(lambda sizes: difference(np.append(sizes, rounded)), free[:count], x_scale="jac").x
    fitted = system(np.append(last, rounded))
    return FractionalFit(fitted, f, response, float(np.sqrt(np.mean(np.abs(fitted(s) / response - 1) ** 2))))


def _moved(start: FractionalTransferFunction, sizes: np.ndarray, orders: np.ndarray) -> FractionalTransferFunction:
    """`start` with its coefficients times exp(sizes), but for the leading one below, and with these orders above 0."""
    above, below = start.numerator, start.denominator
    factors, moved = iter(np.append(np.exp(sizes), 1.0)), iter(orders)
    parts = [[(next(moved) if k else 0, a * next(factors)) for k, a in part.terms] for part in (above, below)]
    return FractionalTransferFunction.of(*parts).delayed(start.delay)
