"""Fractional systems with published answers, and what random ones are made of."""

import numpy as np
from hypothesis import strategies as st

from workbench.control.fractional import FractionalPolynomial, FractionalTransferFunction

s = FractionalTransferFunction.s
# Podlubny, IEEE Trans. Automatic Control 44(1), 1999; the third plant of FOMCON's examples, which is also that of
# Chen, Petráš, Xue, Fractional order control - a tutorial, American Control Conference 2009, but for a sign
PODLUBNY = 1 / (0.8 * s**2.2 + 0.5 * s**0.9 + 1)
FURNACE = 1 / (14994 * s**1.31 + 6009.5 * s**0.97 + 1.69)
THIRD_DENOMINATOR = 2 * s**3.501 + 3.8 * s**2.42 + 2.6 * s**1.798 + 2.5 * s**1.31 + 1.5
PLANTS = [PODLUBNY, FURNACE, (-2 * s**0.63 + 4) / THIRD_DENOMINATOR]

order = st.integers(0, 30).map(lambda tenths: tenths / 10)
size = st.floats(0.1, 10)
coefficient = st.builds(lambda x, up: x if up else -x, size, st.booleans())
polynomial = st.lists(st.tuples(order, coefficient), min_size=1, max_size=3)
system = st.builds(FractionalTransferFunction.of, polynomial.filter(lambda terms: FractionalPolynomial.of(terms).terms),
                   polynomial.filter(lambda terms: FractionalPolynomial.of(terms).terms))  # fmt: skip
AT = 1j * np.geomspace(0.1, 10, 7)
