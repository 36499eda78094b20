"""Explicit fractional transfer functions: sums of fractional powers of s over such sums, and a pure delay."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, ClassVar, Union

import numpy as np

from ...base.errors import InputError
from .norm import H2Norm, h2_norm
from .polynomial import FractionalPolynomial, common_order, order_of
from .stability import Stability, poles, stability
from .time_response import inverse_laplace

if TYPE_CHECKING:
    from ...report.figures import Figure
    from .margins import FractionalMargins
    from .realisation import Realisation

Operand = Union["FractionalTransferFunction", float]


@dataclass(frozen=True)
class FractionalTransferFunction:
    """G(s) = exp(-s delay) sum of b_k s^beta_k / sum of a_k s^alpha_k, s in rad/s, `delay` in s, real coefficients,
    rational orders kept exactly.

    `FractionalTransferFunction.s` is s itself: `1/(0.8*s**2.2 + 0.5*s**0.9 + 1)` writes one down. Powers that numerator
    and denominator share are divided out; common roots are not. Raises InputError for a denominator of 0, for a delay
    below 0, and where a sum or a loop would have terms of different delays.
    """

    numerator: FractionalPolynomial
    denominator: FractionalPolynomial
    delay: float = 0.0
    s: ClassVar["FractionalTransferFunction"]
    __array_ufunc__: ClassVar[None] = None  # a numpy number times a system is a system

    def __post_init__(self) -> None:
        if not self.denominator.terms:
            raise InputError("a fractional transfer function was divided by 0; give it a denominator")
        if not (np.isfinite(self.delay) and self.delay >= 0):
            raise InputError(f"a delay of {self.delay:g} s would look ahead; make it finite and 0 or more")
        lowest = min(part.lowest for part in (self.numerator, self.denominator) if part.terms)
        for name in ("numerator", "denominator"):
            object.__setattr__(self, name, getattr(self, name).shifted(-lowest))

    @classmethod
    def of(
        cls,
        numerator: Iterable[tuple[float | Fraction, float]],
        denominator: Iterable[tuple[float | Fraction, float]],
    ) -> "FractionalTransferFunction":
        """From pairs (order, coefficient) of both."""
        return cls(FractionalPolynomial.of(numerator), FractionalPolynomial.of(denominator))

    @property
    def order(self) -> Fraction:
        """The commensurate order q: the largest that divides all orders of both."""
        return common_order(power for part in (self.numerator, self.denominator) for power, _ in part.terms)

    def __call__(self, s: complex | np.ndarray) -> np.ndarray:
        """G at s [...] [rad/s] of the principal sheet, complex."""
        value = self.numerator(s) / self.denominator(s)
        return np.exp(-self.delay * np.asarray(s)) * value if self.delay else value

    def delayed(self, seconds: float) -> "FractionalTransferFunction":
        """This function, later by so much [s]; a negative number takes a delay away, at most the whole."""
        return replace(self, delay=self.delay + seconds)

    def margins(self) -> "FractionalMargins":
        """Margins of the loop that unit negative feedback closes around this system, its delay exact.

        Raises InputError for a system with as many zeros as poles, or with a pole on the imaginary axis.
        """
        from .margins import nyquist_margins

        return nyquist_margins(self)

    def response(self, f: np.ndarray) -> np.ndarray:
        """The exact frequency response at f [k] > 0 in Hz, complex [k]."""
        return self(2j * np.pi * np.asarray(f, float))

    def bode(self, low: float, high: float) -> "Figure":
        """The exact frequency response between `low` and `high` [Hz] as a figure."""
        from ...report.figures import FrequencyCurve, bode

        f = np.geomspace(low, high, 400)
        return bode(str(self), [FrequencyCurve("exact", f, self.response(f))])

    def stability(self) -> Stability:
        """The stability of its poles, by Matignon's theorem or the argument principle; true where it is stable."""
        return stability(self.denominator)

    def poles(self) -> np.ndarray:
        """Poles [rad/s] on the principal sheet, |arg s| < 0.9 pi, without those at 0; raises InputError as `poles`."""
        return poles(self.denominator)

    def h2_norm(self) -> H2Norm:
        """The H2 norm with its error; infinite, with a reason, where it is."""
        return h2_norm(self.numerator, self.denominator)

    def step(self, t: np.ndarray) -> np.ndarray:
        """Response [n] to a unit step from rest, at t [n] >= 0 in s, in any order."""
        return self._over_time(t, 1)

    def impulse(self, t: np.ndarray) -> np.ndarray:
        """Response [n] to a unit impulse at t [n] >= 0 in s, without the impulse itself where that goes through."""
        return self._over_time(t, 0)

    def oustaloup(self, low: float, high: float) -> "Realisation":
        """State space of it between `low` and `high` [Hz] with Oustaloup's cells for its fractional powers."""
        from .realisation import oustaloup_realisation

        return oustaloup_realisation(self, low, high)

    def least_squares(self, low: float, high: float, states: int) -> "Realisation":
        """State space with so many `states`, fitted by least squares to its response between `low` and `high` [Hz]."""
        from .realisation import least_squares_realisation

        return least_squares_realisation(self, low, high, states)

    def feedback(self, other: Operand = 1.0) -> "FractionalTransferFunction":
        """G/(1 + G H): G with `other` H in negative feedback."""
        back = _as_system(other)
        if self.delay or back.delay:
            raise InputError("a loop with a delay in it is no fractional transfer function; see margins()")
        n, d = self.numerator * back.denominator, self.denominator * back.denominator
        return FractionalTransferFunction(n, d + self.numerator * back.numerator)

    def __add__(self, other: Operand) -> "FractionalTransferFunction":
        if not isinstance(other, _OPERANDS):
            return NotImplemented
        b = _as_system(other)
        if self.delay != b.delay:
            raise InputError(f"a sum of delays of {self.delay:g} and {b.delay:g} s is no fractional transfer function")
        if self.denominator == b.denominator:
            return FractionalTransferFunction(self.numerator + b.numerator, self.denominator, self.delay)
        crossed = self.numerator * b.denominator + b.numerator * self.denominator
        return FractionalTransferFunction(crossed, self.denominator * b.denominator, self.delay)

    def __mul__(self, other: Operand) -> "FractionalTransferFunction":
        if not isinstance(other, _OPERANDS):
            return NotImplemented
        b = _as_system(other)
        above, below = self.numerator * b.numerator, self.denominator * b.denominator
        return FractionalTransferFunction(above, below, self.delay + b.delay)

    def __truediv__(self, other: Operand) -> "FractionalTransferFunction":
        if not isinstance(other, _OPERANDS):
            return NotImplemented
        b = _as_system(other)
        above, below = self.numerator * b.denominator, self.denominator * b.numerator
        return FractionalTransferFunction(above, below, self.delay - b.delay)

    def __pow__(self, exponent: float | Fraction) -> "FractionalTransferFunction":
        """A whole power of any, a fractional one of a single positive power of s over another."""
        power = order_of(exponent)
        if len(self.numerator.terms) == len(self.denominator.terms) == 1 and not self.delay:
            (above, b), (below, a) = self.numerator.terms[0], self.denominator.terms[0]
            if b / a > 0 or power.denominator == 1:
                return FractionalTransferFunction.of([((above - below) * power, (b / a) ** float(power))], [(0, 1.0)])
        if power.denominator != 1:
            raise InputError(
                f"({self})^{float(power):g} is no sum of powers; only c s^a with c > 0 takes a fractional power"
            )
        base = self if power >= 0 else 1 / self
        result = _as_system(1.0)
        for _ in range(abs(int(power))):
            result = result * base
        return result

    def __neg__(self) -> "FractionalTransferFunction":
        return self * -1.0

    def __sub__(self, other: Operand) -> "FractionalTransferFunction":
        return self + -1.0 * other if isinstance(other, _OPERANDS) else NotImplemented

    def __rsub__(self, other: float) -> "FractionalTransferFunction":
        return -self + other

    def __rtruediv__(self, other: float) -> "FractionalTransferFunction":
        return _as_system(other) / self

    __radd__, __rmul__ = __add__, __mul__

    def __repr__(self) -> str:
        above, below = str(self.numerator), str(self.denominator)
        late = f" exp(-{self.delay:g} s)" if self.delay else ""
        above = f"({above})" if len(self.numerator.terms) > 1 and (late or below != "1") else above
        return f"{above}{late}" if below == "1" else f"{above}/({below}){late}"

    def _over_time(self, t: np.ndarray, integrations: int) -> np.ndarray:
        t = np.asarray(t, float)
        if not np.all(np.isfinite(t) & (t >= 0)):
            raise InputError("times must be finite and not below 0")
        if not self.numerator.terms:
            return np.zeros_like(t)
        prompt, t = replace(self, delay=0.0), t - self.delay
        y = np.where(t < 0, 0.0, self._at_start(integrations))
        later = t > 0
        y[later] = inverse_laplace(lambda s: prompt(s) / s**integrations, self.poles(), t[later])
        return y

    def _at_start(self, integrations: int) -> float:
        """The limit for t -> 0 of t^(a - 1)/Gamma(a) times the ratio of the leading coefficients."""
        (above, b), (below, a) = self.numerator.terms[-1], self.denominator.terms[-1]
        rise = below - above + integrations
        return b / a if rise == 1 else 0.0 if rise > 1 else float(np.copysign(np.inf, b / a))


_OPERANDS = (FractionalTransferFunction, int, float, np.integer, np.floating)
FractionalTransferFunction.s = FractionalTransferFunction.of([(1, 1.0)], [(0, 1.0)])


def _as_system(value: Operand) -> FractionalTransferFunction:
    if isinstance(value, FractionalTransferFunction):
        return value
    return FractionalTransferFunction.of([(0, float(value))], [(0, 1.0)])
