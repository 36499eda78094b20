"""The elementary functions that LLVM has no vector form of, accurate to about one unit in the last place.

Polynomials are Taylor series economised by Chebyshev's method when they are needed, so no fitted digits stand here.
"""

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from math import factorial

from .lanes import Code

LIBM = ("log1p", "expm1", "tan", "asin", "acos", "atan", "sinh", "cosh", "asinh", "acosh", "atanh", "erf")
LIBM += ("atan2", "fmod", "hypot", "remainder")  # these are left to the C library, lane by lane

_LOG2_E = 1.4426950408889634
_LN2_HIGH = float.fromhex("0x1.62e42feep-1")  # 33 bits of ln 2: its product with an exponent is exact
_LN2_LOW = float.fromhex("0x1.a39ef35793c76p-33")
_HALF_LN2 = 0.3466
_HALF_PI = (  # 33 bits each of pi/2, and the rest
    float.fromhex("0x1.921fb544p+0"),
    float.fromhex("0x1.0b4611a6p-34"),
    float.fromhex("0x1.3198a2e037073p-69"),
)
_FAR = 2.0**20  # rad: beyond it a sine goes to the C library
_ROUNDER = 1.5 * 2.0**52  # adding it rounds to an integer, which then stands in the low bits
_ONE = 0x3FF0000000000000
_EXPONENT = 0x7FF0000000000000
_SMALLEST, _LARGEST = 2.0**-1022, 1.7976931348623157e308


def exp(c: Code, x: str) -> str:
    """e^x; below 4e-308 it is 0."""
    shifted, q = _exp_reduced(c, x)
    y = c.mul(c.fma(q, c.number(2.0), c.number(2.0)), _power_of_two(c, shifted, -1))
    y = c.select(c.compare("ogt", x, c.number(709.782712893384)), c.number(float("inf")), y)
    return c.select(c.compare("olt", x, c.number(-707.7)), c.number(0.0), y)


def tanh(c: Code, x: str) -> str:
    """(e^2x - 1) / (e^2x + 1) of |x|, with the sign of x."""
    twice = c.intrinsic("fabs", c.add(x, x))
    twice = c.select(c.compare("ogt", twice, c.number(44.0)), c.number(44.0), twice)
    shifted, q = _exp_reduced(c, twice)
    scale = _power_of_two(c, shifted, 0)
    y = c.fma(scale, q, c.sub(scale, c.number(1.0)))
    return c.intrinsic("copysign", c.div(y, c.add(y, c.number(2.0))), x)


def _exp_reduced(c: Code, x: str) -> tuple[str, str]:
    """k + 2^52 * 1.5 and e^r - 1 with x = k ln 2 + r."""
    shifted = c.fma(x, c.number(_LOG2_E), c.number(_ROUNDER))
    k = c.sub(shifted, c.number(_ROUNDER))
    r = c.fma(k, c.number(-_LN2_LOW), c.fma(k, c.number(-_LN2_HIGH), x))
    return shifted, _expm1_small(c, r)


def _expm1_small(c: Code, r: str) -> str:
    tail = c.polynomial(economised(_exp_tail, 18, _HALF_LN2, 9), r)
    return c.fma(c.mul(r, r), tail, r)


def _power_of_two(c: Code, shifted: str, more: int) -> str:
    """2^(k + more) from k + 2^52 * 1.5."""
    bits = c.integers("shl", c.as_bits(shifted), c.integer(52))
    return c.as_double(c.integers("add", bits, c.integer(_ONE + (more << 52))))


def log(c: Code, x: str) -> str:
    """ln x, as in fdlibm: k ln 2 + f - f^2/2 + s (f^2/2 + R(s^2)), s = f / (2 + f)."""
    tiny = c.compare("olt", x, c.number(_SMALLEST))
    k, f = _split(c, c.select(tiny, c.mul(x, c.number(2.0**54)), x))
    k = c.sub(k, c.select(tiny, c.number(54.0), c.number(0.0)))
    s = c.div(f, c.add(f, c.number(2.0)))
    z = c.mul(s, s)
    rest = c.mul(z, c.polynomial(economised(_log_tail, 16, 0.02944, 8), z))
    half = c.mul(c.mul(f, c.number(0.5)), f)
    low = c.fma(s, c.add(half, rest), c.mul(k, c.number(_LN2_LOW)))
    y = c.fma(k, c.number(_LN2_HIGH), c.sub(f, c.sub(half, low)))
    y = c.select(c.compare("ole", x, c.number(_LARGEST)), y, x)
    y = c.select(c.compare("olt", x, c.number(0.0)), c.number(float("nan")), y)
    return c.select(c.compare("oeq", x, c.number(0.0)), c.number(float("-inf")), y)


def _split(c: Code, x: str) -> tuple[str, str]:
    """k and f with x = 2^k (1 + f), 1 + f within sqrt(1/2) and sqrt(2); x positive and normal."""
    bits = c.as_bits(x)
    above = c.integers("add", bits, c.integer(_ONE - 0x3FE6A09E667F3BCD))
    biased = c.integers("or", c.integers("lshr", above, c.integer(52)), c.integer(0x4330000000000000))
    k = c.sub(c.as_double(biased), c.number(2.0**52 + 1023))
    exponent = c.integers("sub", c.integers("and", above, c.integer(_EXPONENT)), c.integer(_ONE))
    return k, c.sub(c.as_double(c.integers("sub", bits, exponent)), c.number(1.0))


def power(c: Code, x: str, y: str) -> str:
    """x^y through a logarithm of twice the precision; signs, zeros and what is not finite go to the C library."""
    if not c.fused:
        return c.lane_by_lane("pow", x, y)
    high, low = _long_log(c, x)
    product = c.mul(y, high)
    error = c.fma(y, low, c.fma(y, high, c.neg(product)))
    shifted = c.fma(product, c.number(_LOG2_E), c.number(_ROUNDER))
    k = c.sub(shifted, c.number(_ROUNDER))
    r = c.add(c.fma(k, c.number(-_LN2_LOW), c.fma(k, c.number(-_LN2_HIGH), product)), error)
    scaled = c.mul(c.add(_expm1_small(c, r), c.number(1.0)), _power_of_two(c, shifted, 0))
    usual = c.compare("ole", c.intrinsic("fabs", product), c.number(707.0))
    usual = c.logic("and", usual, c.compare("oge", x, c.number(_SMALLEST)))
    usual = c.logic("and", usual, c.compare("ole", x, c.number(_LARGEST)))
    return c.usually(usual, scaled, lambda: c.lane_by_lane("pow", x, y))


def _long_log(c: Code, x: str) -> tuple[str, str]:
    """ln x as a sum of two numbers: k ln 2 + 2 s + s z (2/3 + 2/5 z + ...), z = s^2, each product with its rest."""
    k, f = _split(c, x)
    d = c.add(f, c.number(2.0))
    d_low = c.sub(f, c.sub(d, c.number(2.0)))
    inverse = c.div(c.number(1.0), d)
    s = c.mul(f, inverse)
    s_low = c.mul(inverse, c.fma(c.neg(s), d_low, c.fma(c.neg(s), d, f)))
    z, z_low = _product(c, s, s, c.mul(c.add(s_low, s_low), s))
    tail = c.mul(z, c.polynomial(economised(_log_tail, 16, 0.02944, 9)[1:], z))
    t, t_low = _sum(c, c.number(2 / 3), tail)
    t_low = c.add(t_low, c.number(float(Fraction(2, 3) - Fraction(2 / 3))))
    q, q_low = _product(c, z, t, c.fma(z, t_low, c.mul(z_low, t)))
    w, w_low = _product(c, s, q, c.fma(s, q_low, c.mul(s_low, q)))
    first, rest = _sum(c, c.mul(k, c.number(_LN2_HIGH)), c.add(s, s))
    high, low = _sum(c, first, w)
    small = c.fma(k, c.number(_LN2_LOW), c.add(c.add(s_low, s_low), w_low))
    return _sum(c, high, c.add(low, c.add(rest, small)))


def _product(c: Code, a: str, b: str, more: str) -> tuple[str, str]:
    product = c.mul(a, b)
    return product, c.add(c.fma(a, b, c.neg(product)), more)


def _sum(c: Code, large: str, small: str) -> tuple[str, str]:
    total = c.add(large, small)
    return total, c.sub(small, c.sub(total, large))


def sin(c: Code, x: str) -> str:
    """Sine of x [rad]."""
    return _circular(c, x, 0, "sin")


def cos(c: Code, x: str) -> str:
    """Cosine of x [rad]."""
    return _circular(c, x, 1, "cos")


def _circular(c: Code, x: str, quarter: int, name: str) -> str:
    shifted = c.fma(x, c.number(1 / sum(_HALF_PI)), c.number(_ROUNDER))
    k = c.sub(shifted, c.number(_ROUNDER))
    r = x
    for part in _HALF_PI:
        r = c.fma(k, c.number(-part), r)
    z = c.mul(r, r)
    sine = c.fma(c.mul(r, z), c.polynomial(economised(_sin_tail, 14, 0.62, 6), z), r)
    tail = c.polynomial(economised(_cos_tail, 14, 0.62, 6), z)
    cosine = c.fma(c.mul(z, z), tail, c.fma(z, c.number(-0.5), c.number(1.0)))
    quadrant = c.integers("add", c.as_bits(shifted), c.integer(quarter))
    odd = c.do(f"icmp ne {c.bits} {c.integers('and', quadrant, c.integer(1))}, {c.integer(0)}")
    sign = c.integers("shl", c.integers("and", quadrant, c.integer(2)), c.integer(62))
    y = c.as_double(c.integers("xor", c.as_bits(c.select(odd, cosine, sine)), sign))
    near = c.compare("ole", c.intrinsic("fabs", x), c.number(_FAR))
    return c.usually(near, y, lambda: c.lane_by_lane(name, x))


def extreme(c: Code, condition: str, x: str, y: str, constant: bool) -> str:
    """fmin ("olt") or fmax ("ogt") as in C: what is not a number loses. `constant`: y is a number for certain."""
    nearer = c.select(c.compare(condition, x, y), x, y)
    return nearer if constant else c.select(c.compare("uno", y, y), x, nearer)


def sign(c: Code, x: str) -> str:
    """-1, 1, or x itself when it is 0 or not a number."""
    positive = c.select(c.compare("ogt", x, c.number(0.0)), c.number(1.0), x)
    return c.select(c.compare("olt", x, c.number(0.0)), c.number(-1.0), positive)


@cache
def economised(series: Callable[[int], Fraction], terms: int, half_range: float, degree: int) -> tuple[float, ...]:
    """Coefficients of degree `degree` of a power series, nearly the best in +-half_range: the surplus powers are
    replaced by lower ones through Chebyshev's polynomials."""
    c = [series(k) for k in range(terms)]
    a = Fraction(half_range)
    while len(c) > degree + 1:
        n = len(c) - 1
        top = c.pop() / 2 ** (n - 1)
        for k, t in enumerate(_chebyshev(n)[:-1]):
            c[k] -= top * t * a ** (n - k)
    return tuple(map(float, c))


def _chebyshev(n: int) -> list[int]:
    before, now = [1], [0, 1]
    for _ in range(n - 1):
        after = [0, *(2 * t for t in now)]
        for k, t in enumerate(before):
            after[k] -= t
        before, now = now, after
    return now


def _exp_tail(k: int) -> Fraction:
    return Fraction(1, factorial(k + 2))


def _log_tail(k: int) -> Fraction:
    return Fraction(2, 2 * k + 3)


def _sin_tail(k: int) -> Fraction:
    return Fraction((-1) ** (k + 1), factorial(2 * k + 3))


def _cos_tail(k: int) -> Fraction:
    return Fraction((-1) ** k, factorial(2 * k + 4))
