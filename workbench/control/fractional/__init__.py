"""Fractional systems as objects: explicit fractional transfer functions, what they do and what stands for them.

    s = FractionalTransferFunction.s
    G = 1 / (0.8 * s**2.2 + 0.5 * s**0.9 + 1)

transfer_function   sums of fractional powers of s over such sums: arithmetic, exact response, steps and impulses
polynomial          such a sum, with exact orders
stability           poles, Matignon's theorem, and the argument principle for orders with nothing in common
margins             Nyquist margins of the loop around one, with a delay
norm                the H2 norm, by residues or by an integral with its error
time_response       inverse Laplace transform on contours
realisation         state spaces over a band, by Oustaloup's cells or by least squares, with their errors
fit                 a fractional system of a measured frequency response
"""

from .fit import FractionalFit, fit_fractional, fit_orders
from .margins import FractionalMargins
from .norm import H2Norm
from .polynomial import FractionalPolynomial
from .realisation import Realisation
from .stability import Stability
from .transfer_function import FractionalTransferFunction

__all__ = [
    "FractionalFit",
    "FractionalMargins",
    "FractionalPolynomial",
    "FractionalTransferFunction",
    "H2Norm",
    "Realisation",
    "Stability",
    "fit_fractional",
    "fit_orders",
]
