"""Laws handed over to a rig's own digital controller.

program           what code of a law consists of, and the vector that checks it
statements        a graph as statements of a language
c_code            a law in C99
structured_text   a law in Structured Text of IEC 61131-3
kernel_text       the loops of a kernel in both
link_program      a program that runs laws in C99 at a rig behind a wire
sections          second-order sections by input, schedules, the map of the command: a law's linear view
listing           these as JSON, and as text for people; linear models for MATLAB and python-control
"""

from .listing import as_json, as_text
from .program import Program
from .sections import Coefficients, SectionChannel, coefficients, replay

__all__ = ["Coefficients", "Program", "SectionChannel", "as_json", "as_text", "coefficients", "replay"]
