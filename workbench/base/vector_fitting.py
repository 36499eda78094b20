"""A rational function fitted to a frequency response: poles moved by least squares until they stay."""

import numpy as np

from .errors import InputError

_ROUNDS = 30
_SETTLED = 1e-10  # relative move of the poles


Realised = tuple[np.ndarray, np.ndarray, np.ndarray, float]


def vector_fit(f: np.ndarray, response: np.ndarray, states: int, direct: bool, mirrored: bool = True) -> Realised:
    """A [n, n], b [n], c [n] and d of n `states` near a response [k] at f [k] in Hz, relative error weighed evenly.

    In each round sum c_i/(s - p_i) + d = (1 + sum e_i/(s - p_i)) G is solved for c, d, e; the zeros of the right factor
    are the next poles, those right of the imaginary axis `mirrored` or not (Gustavsen and Semlyen, IEEE Trans. Power
    Delivery 14(3), 1999). `direct` says whether there is a d. Raises InputError for fewer points than numbers to be
    found.
    """
    if not 1 <= states <= len(f) // 2:
        raise InputError(f"{states} states: must be 1 to {len(f) // 2}, half of the points of the response")
    centre = 2 * np.pi * np.sqrt(f[0] * f[-1])
    s, weight = 2j * np.pi * f / centre, 1 / np.abs(response)
    poles = -np.geomspace(abs(s[0]), abs(s[-1]), states).astype(complex)
    for _ in range(_ROUNDS):
        basis = _basis(s, poles)
        own = np.column_stack((basis, np.ones(len(s)))) if direct else basis
        solution = _least_squares(np.column_stack((own, -response[:, None] * basis)), response, weight)
        moved = _sorted(_zeros(poles, solution[own.shape[1] :], mirrored))
        settled = np.abs(moved - poles).max() < _SETTLED * np.abs(poles).max()
        poles = moved
        if settled:
            break
    own = np.column_stack((_basis(s, poles), np.ones(len(s)))) if direct else _basis(s, poles)
    solution = _least_squares(own, response, weight)
    a, b = _modal(poles)
    d = solution[-1] if direct else 0.0
    return centre * a, centre * b, solution[: len(a)], float(d)


def _basis(s: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """Columns [k, n] whose real combinations are the functions with these poles: those of `_modal` from its B."""
    columns = []
    for pole in poles:
        if pole.imag == 0:
            columns.append(1 / (s - pole))
        elif pole.imag > 0:
            columns += [1 / (s - pole) + 1 / (s - pole.conj()), 1j / (s - pole) - 1j / (s - pole.conj())]
    return np.column_stack(columns)


def _modal(poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A [n, n] of real blocks and B [n] whose states answer with the columns of `_basis`."""
    n = len(poles)
    a, b = np.zeros((n, n)), np.zeros(n)
    place = 0
    for pole in poles:
        if pole.imag == 0:
            a[place, place], b[place] = pole.real, 1.0
            place += 1
        elif pole.imag > 0:
            a[place : place + 2, place : place + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
            b[place] = 2.0
            place += 2
    return a, b


def _zeros(poles: np.ndarray, shares: np.ndarray, mirrored: bool) -> np.ndarray:
    """Zeros of 1 + sum of shares over the basis, mirrored into the left half plane where that is asked for."""
    a, b = _modal(poles)
    zeros = np.linalg.eigvals(a - np.outer(b, shares)).astype(complex)
    return -np.abs(np.real(zeros)) + 1j * np.imag(zeros) if mirrored else zeros


def _sorted(poles: np.ndarray) -> np.ndarray:
    """Real ones first, then pairs, exactly conjugate."""
    real = np.sort(poles[np.imag(poles) == 0])
    upper = poles[np.imag(poles) > 0]
    upper = upper[np.lexsort((np.real(upper), np.imag(upper)))]
    return np.concatenate((real, np.column_stack((upper, upper.conj())).ravel()))


def _least_squares(columns: np.ndarray, response: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Real coefficients of complex columns [k, n], the columns scaled to one size first."""
    weighed, target = columns * weight[:, None], response * weight
    whole = np.concatenate((np.real(weighed), np.imag(weighed)))
    size = np.linalg.norm(whole, axis=0)
    target = np.concatenate((np.real(target), np.imag(target)))
    return np.linalg.lstsq(whole / size, target, rcond=None)[0] / size
