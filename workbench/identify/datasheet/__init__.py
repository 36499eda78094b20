"""Valves fitted to what their makers say.

corners     the figures of a valve on its benches
valve_fit   a valve's numbers from its datasheet
corrector   the corrector in the spool loop that gives a maker's curve
"""
