"""Valves fitted to the figures that their makers publish.

corners     the figures of a valve on its benches
valve_fit   a valve's numbers from its datasheet
corrector   the corrector in the spool loop that gives a maker's curve

    from workbench.identify.datasheet import corner_frequencies, second_order_numbers
    numbers = second_order_numbers(sheet)                         # f0, zeta, lands and lap, with their sources
    sine, f3db, f90 = corner_frequencies(rig, response, 40)       # Hz, from a stepped sine on the bench
"""

import lazy_loader

# Closed forms need not wait for the benches.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
