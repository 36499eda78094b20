"""A rational function near a complex response, by linear least squares whose weights are corrected until they stay.

It is the core of every fit of a rational function: models with a delay (records/rational_fit), state spaces of
fractional systems (control/fractional/realisation) and fractional systems, rational in s^q (control/fractional/fit).
identify/sheet is none of them: it moves a rig's own numbers through simulated sines of a nonlinear plant, and sheets
may state a gain without a phase.
"""

from dataclasses import dataclass

import numpy as np

_ROUNDS = 30
_SETTLED = 1e-10  # change of the denominator, relative to its largest value
_NOTHING = 1e-12  # of a polynomial's other coefficients: a leading one with less is 0, and its root at infinity


@dataclass(frozen=True, eq=False)
class RationalFunction:
    """gain prod(x - zeros)/prod(x - poles), all of them finite; `error` is the root mean square of its difference from
    the response that it was fitted to, relative to it."""

    zeros: np.ndarray
    poles: np.ndarray
    gain: float
    error: float


def fit_rational_function(
    x: np.ndarray, response: np.ndarray, zeros: int, poles: int, mirrored: bool = False
) -> RationalFunction:
    """At most `zeros` zeros and `poles` poles, near a response [k], nowhere 0, at complex x [k]; relative errors count.

    Each round makes |N - G D| over |G| and the D of the round before smallest (Sanathanan and Koerner, IEEE Trans.
    Automatic Control 8(1), 1963), N and D in polynomials that are orthonormal under these weights, so that high degrees
    over wide bands stay well conditioned (Hokanson and Magruder, arXiv 1811.12587); N follows D once more. The round of
    the least error is taken. `mirrored`, for x on the imaginary axis: poles right of it are mirrored into the left half
    plane, as in vector fitting (Gustavsen and Semlyen, IEEE Trans. Power Delivery 14(3), 1999); |D| stays what it was.
    """
    best, below = None, np.ones(len(x))
    for _ in range(_ROUNDS):
        above = _Basis.of(x, 1 / (np.abs(response) * below), zeros)
        beneath = _Basis.of(x, 1 / below, poles)
        columns = np.column_stack((above.values / response[:, None], -beneath.values)) / below[:, None]
        numbers = np.linalg.svd(_real(columns), full_matrices=False)[2][-1][zeros + 1 :]
        roots, d = beneath.roots(numbers), beneath.values @ numbers
        if mirrored:
            right = roots[np.real(roots) > 0]
            d = d * np.prod((x[:, None] + right.conj()) / (x[:, None] - right), axis=1)
            roots = -np.abs(np.real(roots)) + 1j * np.imag(roots)
        columns = above.values / (response * d)[:, None]
        numbers = np.linalg.lstsq(_real(columns), _real(np.ones(len(x), complex)))[0]
        fitted = columns @ numbers
        error = float(np.sqrt(np.mean(np.abs(fitted - 1) ** 2)))
        if best is None or error < best.error:
            best = _function(x, fitted * response, above.roots(numbers), roots, error)
        size = np.abs(d) / np.abs(d).max()
        if np.abs(size - below).max() < _SETTLED:
            break
        below = size
    assert best is not None
    return best


@dataclass(frozen=True, eq=False)
class _Basis:
    """Real polynomials orthonormal over weighed points: their values [k, n + 1] there, and the recurrence H [n + 1, n]
    of x p_j = sum of H_ij p_i."""

    values: np.ndarray
    recurrence: np.ndarray

    @classmethod
    def of(cls, x: np.ndarray, weight: np.ndarray, degree: int) -> "_Basis":
        """By Arnoldi's process (Brubeck, Nakatsukasa and Trefethen, SIAM Review 63(2), 2021)."""
        values, recurrence = np.zeros((len(x), degree + 1), complex), np.zeros((degree + 1, degree))
        values[:, 0] = 1 / np.linalg.norm(weight)
        for j in range(degree):
            following, known = x * values[:, j], values[:, : j + 1]
            for _ in range(2):  # the second time for what rounding left
                along = np.real(known.conj().T @ (weight**2 * following))
                following = following - known @ along
                recurrence[: j + 1, j] += along
            recurrence[j + 1, j] = np.linalg.norm(weight * following)
            values[:, j + 1] = following / recurrence[j + 1, j]
        return cls(values, recurrence)

    def roots(self, numbers: np.ndarray) -> np.ndarray:
        """The finite zeros of the polynomial with coefficients [n + 1]."""
        n = int(np.flatnonzero(np.abs(numbers) > _NOTHING * np.abs(numbers).max())[-1])
        h = self.recurrence[: n + 1, :n]
        return np.linalg.eigvals(h[:n] - np.outer(numbers[:n] / numbers[n], h[n])).astype(complex)


def _function(
    x: np.ndarray, fitted: np.ndarray, zeros: np.ndarray, poles: np.ndarray, error: float
) -> RationalFunction:
    """With the gain that gives the `fitted` response."""
    shape = np.prod(x[:, None] - zeros, axis=1) / np.prod(x[:, None] - poles, axis=1)
    return RationalFunction(zeros, poles, float(np.median(np.real(fitted / shape))), error)


def _real(columns: np.ndarray) -> np.ndarray:
    return np.concatenate((np.real(columns), np.imag(columns)))
