"""jackbench's workbench: the physics of a jack, its views, and what is measured on it.

    import workbench as wb
    from controllers import P, PressureFeedback

    rig = wb.load_rig("jack-10t")
    loop = wb.ClosedLoop(rig, P(gain=3.7) + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz"))
    loop.step("10 mm").plot()

loops        ClosedLoop, tune, benchmark, robustness, faults, sines, inverse; SCENARIOS, RIG_SET
campaigns    trace, fit, residual, plan, load_campaign, read_record; frequency_response, of any two columns
experiments  run, what the commands compute that take an experiment; retune, on a rig as found
commands     every other command of the command line: limit, capability, watch, commission, excite, record, fmu, ...
rigs         load_rig, save_rig, Rig, variation, with_delay; linear_plant, of a python-control system; trust
plants       build, Plant, Engine, equilibrium, linearise, discretise, stepped_sine, known_effects
controllers  controller, of one's own "file.py:Class"; Controller, design_numbers and number, to write one
fractional   FractionalTransferFunction, fit_fractional; read_sheet, of a frequency response
figures      Figure, Panel, Curve, Table; numbers are SI, or text with a unit: quantity, to_si, from_si, SIGNALS

The rooms, from the ground up, each importing only from those above it in this list:

base        errors, units, signals, TOML, worker processes
records     recordings, campaign folders, excitations
rigs        a rig's numbers with units, sources and bounds
report      figures as data, HTML pages, still pictures
plant       the physics, written once as a symbolic graph; valves in plant/valve, what a model may lack in plant/effects
engine      simulation with inputs held over intervals
linear      equilibria, linear and nonlinear python-control systems, frequency response
control     control laws: what a controller is, and what designs are made of
loop        closed loops, and every number that is measured on one
identify    noise floor, fits, and traces: what a rig's model lacks
link        a rig on UDP: the plant served in lockstep or real time, and the workbench at a live rig
commands    one folder a command of the command line
notebook    the door for Python: loops, searches and campaigns as objects that show themselves
cli         the command line, which imports the chosen command only
"""

from types import FunctionType
from typing import Any

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """A function says in one line what it wants, and builds the plant of a rig where it wants a plant."""
    value = _load(name)
    if isinstance(value, FunctionType):
        from .notebook.door import shown

        value = globals()[name] = shown(value)
    return value
