"""Design of position laws by their phase: powers of s, sections without polynomials, the jack in six numbers."""

from .crossover import gain_for, order_for
from .damped import damped, overshoots, peak
from .error_law import ErrorLaw
from .jack_model import JackModel, fit_jack_model
from .oustaloup import band, oustaloup, power
from .sections import Factors, SectionFilter, integral, pair, sections_response, sections_system, tustin
from .spread import overshoot_spread, spread
from .template import TemplateLaw, template_phase

__all__ = [
    "ErrorLaw",
    "Factors",
    "JackModel",
    "SectionFilter",
    "TemplateLaw",
    "band",
    "damped",
    "fit_jack_model",
    "gain_for",
    "integral",
    "order_for",
    "oustaloup",
    "overshoot_spread",
    "overshoots",
    "pair",
    "peak",
    "power",
    "sections_response",
    "sections_system",
    "spread",
    "template_phase",
    "tustin",
]
