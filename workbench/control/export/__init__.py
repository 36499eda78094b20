"""Laws handed over to a rig's own digital controller.

sections          second-order sections by input, schedules, the map of the command, and a test vector
listing           these as JSON, and as text for people
c_code            a law in C99
planned_c         a predictive law within it
kernel_text       the loops of a kernel in C99 and in Structured Text
structured_text   a law in Structured Text of IEC 61131-3
link_program      a program that runs laws in C99 at a rig behind a wire
matlab            linear models for MATLAB and python-control
"""

from .listing import as_json, as_text
from .sections import Coefficients, SectionChannel, coefficients, replay

__all__ = ["Coefficients", "SectionChannel", "as_json", "as_text", "coefficients", "replay"]
