"""Valves fitted to the figures that their makers publish.

corners     the figures of a valve on its benches
valve_fit   a valve's numbers from its datasheet
corrector   the corrector in the spool loop that gives a maker's curve

    from workbench.identify.datasheet import corner_frequencies, second_order_numbers
    numbers = second_order_numbers(sheet)                         # f0, zeta, lands and lap, with their sources
    sine, f3db, f90 = corner_frequencies(rig, response, 40)       # Hz, from a stepped sine on the bench
"""

from typing import TYPE_CHECKING

from ...base.lazy import lazy_names

if TYPE_CHECKING:
    from .corners import FigureErrors, corner_frequencies, rated_flow
    from .corrector import Corrected, Maker, SpoolLoop
    from .valve_fit import ValveFit, fit_three_stage, second_order_numbers, source_of

__all__ = [
    "Corrected",
    "FigureErrors",
    "Maker",
    "SpoolLoop",
    "ValveFit",
    "corner_frequencies",
    "fit_three_stage",
    "rated_flow",
    "second_order_numbers",
    "source_of",
]

# Closed forms need not wait for the benches.
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "corners": ("FigureErrors", "corner_frequencies", "rated_flow"),
        "corrector": ("Corrected", "Maker", "SpoolLoop"),
        "valve_fit": ("ValveFit", "fit_three_stage", "second_order_numbers", "source_of"),
    },
)
