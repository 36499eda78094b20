"""Fractional design (CRONE): laws by their phase about the crossover.

oustaloup   powers of s between its integers, as poles and zeros
template    what a design asks of its plant; the order and the gain that give a phase margin and a crossover; the law of
            an open-loop template
"""

from .oustaloup import band, oustaloup, power
from .template import CroneTemplateController, gain_for, order_for, template_phase

__all__ = ["CroneTemplateController", "band", "gain_for", "order_for", "oustaloup", "power", "template_phase"]
