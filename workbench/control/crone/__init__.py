"""Fractional design (CRONE): laws by their phase about the crossover.

oustaloup   powers of s between its integers, as poles and zeros
crossover   what a design asks of its plant; the order and the gain that give a phase margin and a crossover
template    the law of an open-loop template
"""

from .crossover import gain_for, order_for
from .oustaloup import band, oustaloup, power
from .template import CroneTemplateController, template_phase

__all__ = ["CroneTemplateController", "band", "gain_for", "order_for", "oustaloup", "power", "template_phase"]
