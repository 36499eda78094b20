"""A rational model with a delay, fitted to a frequency response.

Poles and zeros start from linear least squares; then all numbers and the delay are moved together by nonlinear least
squares of the relative error, which every frequency shares alike (Pintelon and Schoukens, System Identification: A
Frequency Domain Approach, 2nd ed., Wiley 2012, ch. 9). Of several orders the one of the least Bayesian information
criterion is taken.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError
from ..base.rational_function import fit_rational_function
from ..base.words import counted

MOST_POLES = 8
_MOST_INTEGRATORS = 2
_NEGLIGIBLE = 1e-4  # relative error: below it no order is better than another
_WORSE = 2  # orders in a row without gain end the search
_SLOPE = -0.8, 1.2  # of the slope at the low end less the integrators that are tried
BENT, _AS_GOOD = 0.02, 1.25  # of the response; of the best model's error
_FAR = 1e6  # of the highest frequency: as good as infinity
_BELOW = 0.1  # of the lowest frequency: what is below is not told from a pole or zero at 0


@dataclass(frozen=True, eq=False)
class RationalFit:
    """numerator(s)/denominator(s) exp(-s delay), highest powers first, beside the response [k] at f [k] in Hz."""

    numerator: np.ndarray
    denominator: np.ndarray
    delay: float
    f: np.ndarray
    response: np.ndarray

    @property
    def fitted(self) -> np.ndarray:
        """Response [k] of the model at f."""
        s = 2j * np.pi * self.f
        return np.polyval(self.numerator, s) / np.polyval(self.denominator, s) * np.exp(-s * self.delay)

    @property
    def errors(self) -> np.ndarray:
        """Size of the relative difference [k]."""
        return np.abs(self.fitted / self.response - 1)

    @property
    def error(self) -> float:
        """Root mean square of the relative difference."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def unstable(self) -> np.ndarray:
        """Its poles [rad/s] right of the imaginary axis."""
        poles = np.roots(self.denominator)
        return poles[np.real(poles) > 1e-9 * np.abs(poles).max(initial=0.0)]

    @property
    def order(self) -> str:
        """Poles, integrators among them, zeros and delay in words."""
        poles, zeros = len(self.denominator) - 1, len(self.numerator) - 1
        integrators = poles - np.flatnonzero(self.denominator)[-1]
        poles_said = f"{counted(poles, 'pole')} ({integrators} at 0)"
        return f"{poles_said}, {counted(zeros, 'zero')}, delay {round(1e3 * self.delay, 6):.3g} ms"

    def __repr__(self) -> str:
        worst = int(np.argmax(self.errors))
        band = f"{self.f[0]:g} to {self.f[-1]:g} Hz"
        largest = f"at most {100 * self.errors[worst]:.2g} % at {self.f[worst]:g} Hz"
        return f"{self.order}; within {100 * self.error:.2g} % rms from {band}, {largest}"


@dataclass(frozen=True)
class FitOrder:
    """What is known of a model beforehand; what is None is chosen. `stable` keeps its poles left of the axis."""

    poles: int | None = None
    zeros: int | None = None
    integrators: int | None = None
    delay: float | None = None
    stable: bool = True


def fit_rational(f: np.ndarray, response: np.ndarray, order: FitOrder | None = None) -> RationalFit:
    """A strictly proper model near a response [k] at f [k] in Hz, rising. Raises InputError for too few frequencies."""
    order = order or FitOrder()
    most = min(MOST_POLES, (2 * len(f) - 2) // 3)
    if (order.poles or 1) > most or (order.poles is not None and order.poles < max(1, order.integrators or 0)):
        raise InputError(
            f"{order.poles or 1} poles of {len(f)} frequencies: must be {max(1, order.integrators or 0)} to {most}"
        )
    if order.zeros is not None and order.zeros >= (order.poles or most):
        raise InputError(f"{order.zeros} zeros: must be fewer than the poles")
    candidates = [pair for k in _integrators(f, response, order) for pair in _searched(f, response, order, k, most)]
    if not candidates:
        raise InputError("no model of this order; give other poles, zeros or integrators")
    return min(candidates, key=lambda pair: pair[1])[0]


def fit_judged(f: np.ndarray, response: np.ndarray, judges: tuple[np.ndarray, ...]) -> tuple[RationalFit, float]:
    """The model near a response [k] at f [k] in Hz whose order serves another response best; its rms error there.

    `judges` are f [j], response [j] and 95 % radius [j] to which no model is fitted. An error counts over the radius,
    or over BENT of the response where that is more: what bends is in no radius. Of the models that are as good as the
    best within _AS_GOOD, the one with the fewest numbers is taken. Raises InputError.
    """
    order, most = FitOrder(), min(MOST_POLES, (2 * len(f) - 2) // 3)
    other, truth, radius = judges
    found = [fit for k in _integrators(f, response, order) for fit, _ in _searched(f, response, order, k, most)]
    if not found:
        raise InputError(f"{len(f)} frequencies bear no model; record a wider band")
    unit = np.maximum(radius, BENT * np.abs(truth))
    errors = [float(np.sqrt(np.mean(np.abs((replace(fit, f=other).fitted - truth) / unit) ** 2))) for fit in found]
    good = [k for k, error in enumerate(errors) if error <= _AS_GOOD * min(errors)]
    chosen = min(good, key=lambda k: (len(found[k].numerator) + len(found[k].denominator), errors[k]))
    return found[chosen], errors[chosen]


def _searched(
    f: np.ndarray, response: np.ndarray, order: FitOrder, integrators: int, most: int
) -> list[tuple[RationalFit, float]]:
    """Models with their criterion, poles added until that does not help any more."""
    searched: list[tuple[RationalFit, float]] = []
    least, worse = np.inf, 0
    for poles in [order.poles] if order.poles else range(max(1, integrators), most + 1):
        fits = list(_fits(f, response, order, poles, integrators))
        lowest = min((criterion for _, criterion in fits), default=np.inf)
        searched += fits
        worse = 0 if lowest < least else worse + 1
        least = min(lowest, least)
        if worse == _WORSE and least < np.inf:
            break
    return searched


def _integrators(f: np.ndarray, response: np.ndarray, order: FitOrder) -> list[int]:
    """Numbers of poles at 0 that the slope at the low end speaks for."""
    if order.integrators is not None:
        return [order.integrators]
    count = max(3, len(f) // 10)
    slope = -np.polyfit(np.log(f[:count]), np.log(np.abs(response[:count])), 1)[0]
    most = min(_MOST_INTEGRATORS, order.poles or MOST_POLES)
    return [k for k in range(most + 1) if _SLOPE[0] < slope - k < _SLOPE[1]] or [0]


def _fits(
    f: np.ndarray, response: np.ndarray, order: FitOrder, poles: int, integrators: int
) -> Iterator[tuple[RationalFit, float]]:
    """Models of one number of poles with their criterion; the largest zeros are left out one by one."""
    own = poles - integrators
    start, delay = _best_start(f, response * (2j * np.pi * f) ** integrators, order, own, bool(integrators))
    counts = range(own - 1 + bool(integrators), -1, -1) if order.zeros is None else [order.zeros]
    for count in counts:
        if count < poles:
            fit, criterion = _polished(f, response, start, delay, count, integrators, order)
            if criterion < np.inf:
                yield fit, criterion


def _best_start(
    f: np.ndarray, response: np.ndarray, order: FitOrder, poles: int, direct: bool
) -> tuple[tuple[np.ndarray, np.ndarray], float]:
    """Zeros and poles [rad/s] and the delay of a grid with which they are nearest; one at infinity is far off."""
    if not poles:
        return (np.zeros(0), np.zeros(0)), order.delay or 0.0
    turned = -float(np.unwrap(np.angle(response))[-1] - np.angle(response[0]))
    steps = 1 + max(0, int(np.ceil(4 * turned / (2 * np.pi))))
    delays = [order.delay] if order.delay is not None else np.arange(steps) / (4 * f[-1])
    s, far = 2j * np.pi * f, _FAR * 2 * np.pi * f[-1]
    best, least, nearest = (np.zeros(0), np.zeros(0)), np.inf, 0.0
    for delay in delays:
        zeros = poles if direct else poles - 1
        found = fit_rational_function(s, response * np.exp(s * delay), zeros, poles, order.stable)
        if found.error < least:
            best, least = (
                (_smallest_first(found.zeros, zeros, far), _smallest_first(found.poles, poles, far)),
                found.error,
            )
            nearest = float(delay)
    return best, nearest


def _smallest_first(roots: np.ndarray, count: int, far: float) -> np.ndarray:
    return np.append(roots[np.argsort(np.abs(roots), kind="stable")], np.full(count - len(roots), -far))


def _polished(
    f: np.ndarray,
    response: np.ndarray,
    start: tuple[np.ndarray, np.ndarray],
    delay: float,
    zeros: int,
    integrators: int,
    order: FitOrder,
) -> tuple[RationalFit, float]:
    """All numbers moved together, from the `zeros` smallest zeros of the start; the model and its criterion."""
    from scipy.optimize import least_squares

    centre = 2 * np.pi * float(np.sqrt(f[0] * f[-1]))
    x, free = 2j * np.pi * f / centre, order.delay is None
    above, below = _sections(start[0][:zeros] / centre, zeros), _sections(start[1] / centre, len(start[1]))

    def model(values: np.ndarray) -> np.ndarray:
        top, bottom = values[1 : 1 + zeros], values[1 + zeros : 1 + zeros + len(below)]
        late = values[-1] if free else delay * centre
        return values[0] * _product(top, x) / _product(bottom, x) / x**integrators * np.exp(-x * late)

    def difference(values: np.ndarray) -> np.ndarray:
        off = model(values) / response - 1
        return np.concatenate((np.real(off), np.imag(off)))

    left_out = float(np.real(1 / start[0][zeros:]).sum())  # 1 - s/z is as late as exp(-s/z)
    values = np.concatenate(([1.0], above, below, [max(delay + left_out, 0.0) * centre] if free else []))
    shape = response / model(values)
    values[0] = float(np.real(shape).sum() / len(f)) or 1.0
    low = np.full(len(values), -np.inf)
    low[1 + zeros : 1 + zeros + len(below)] = 0.0 if order.stable else -np.inf
    low[len(values) - free :] = 0.0
    moved = least_squares(difference, np.maximum(values, low), bounds=(low, np.inf), x_scale="jac", max_nfev=100).x
    bottom = _polynomial(moved[1 + zeros : 1 + zeros + len(below)])
    fit = RationalFit(
        _in_s(moved[0] * _polynomial(moved[1 : 1 + zeros]), centre),
        _in_s(np.concatenate((bottom, np.zeros(integrators))), centre),
        float(moved[-1]) / centre if free else delay,
        f,
        response,
    )
    if len(fit.numerator) >= len(fit.denominator) or (order.integrators is None and _counts_wrong(fit, integrators)):
        return fit, np.inf
    count = 2 * len(f)
    return fit, count * np.log(fit.error**2 + _NEGLIGIBLE**2) + len(values) * np.log(count)


def _counts_wrong(fit: RationalFit, integrators: int) -> bool:
    """Whether a pole far below the band should be one more integrator, or a zero there should be one less."""
    edge = _BELOW * 2 * np.pi * fit.f[0]
    low_poles, low_zeros = (np.sum(np.abs(np.roots(part)) < edge) for part in (fit.denominator, fit.numerator))
    return bool((low_zeros and integrators) or (integrators < _MOST_INTEGRATORS and low_poles > integrators))


def _sections(roots: np.ndarray, count: int) -> np.ndarray:
    """Numbers a, b of the factors 1 + a x + b x^2 of `count` roots, of an odd one the a of 1 + a x."""
    size = np.maximum(np.abs(roots), 1e-6)
    real = np.where(np.real(roots) > 0, size, -size)
    pairs = roots[np.imag(roots) > 0]
    pairs = [r for r in pairs if np.min(np.abs(roots - r.conj())) < 1e-6 * abs(r)]
    both = np.array([*pairs, *np.conj(pairs)])
    alone = np.sort(
        [r for r, root in zip(real, roots, strict=True) if not np.any(np.abs(both - root) < 1e-6 * abs(root))]
    )
    values = [value for r in pairs for value in (-2 * r.real / abs(r) ** 2, 1 / abs(r) ** 2)]
    for first, second in zip(alone[0::2], alone[1::2], strict=False):
        values += [-1 / first - 1 / second, 1 / (first * second)]
    if len(alone) % 2:
        values.append(-1 / alone[-1])
    return np.array(values[:count])


def _factors(values: np.ndarray) -> Iterator[np.ndarray]:
    """The factors' coefficients, the highest power first."""
    for i in range(0, len(values) - 1, 2):
        yield np.array([values[i + 1], values[i], 1.0])
    if len(values) % 2:
        yield np.array([values[-1], 1.0])


def _product(values: np.ndarray, x: np.ndarray) -> np.ndarray:
    whole = np.ones(len(x), complex)
    for factor in _factors(values):
        whole = whole * np.polyval(factor, x)
    return whole


def _polynomial(values: np.ndarray) -> np.ndarray:
    whole = np.ones(1)
    for factor in _factors(values):
        whole = np.polymul(whole, factor)
    return whole


def _in_s(coefficients: np.ndarray, centre: float) -> np.ndarray:
    """A polynomial of s/centre as one of s, without zeros at its head."""
    powers = np.arange(len(coefficients) - 1, -1, -1)
    return (
        np.trim_zeros(coefficients, "f") / centre ** powers[len(coefficients) - len(np.trim_zeros(coefficients, "f")) :]
    )
