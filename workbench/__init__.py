"""jackbench's workbench: the physics of a jack, its views, and what is measured on it.

    import workbench as wb
    from controllers import P, PressureFeedback

    rig = wb.load_rig("jack-10t")
    loop = wb.ClosedLoop(rig, P(gain=3.7) + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz"))
    loop.step("10 mm").plot()

loops        ClosedLoop, tune, benchmark, robustness, faults, sines, inverse; SCENARIOS, RIG_SET
campaigns    trace, fit, residual, plan, load_campaign, read_record
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
from typing import TYPE_CHECKING, Any

from .base.lazy import lazy_names

if TYPE_CHECKING:
    from .base.errors import InputError
    from .base.signals import SIGNALS
    from .base.trust import trust
    from .base.units import from_si, quantity, to_si
    from .control.controller_spec import ControllerSpec
    from .control.controller_type import controller
    from .control.fractional import FractionalTransferFunction, fit_fractional
    from .control.protocol import Controller, design_numbers, number
    from .engine import Engine, Trajectory
    from .linear import Equilibrium, discretise, equilibrium, linearise, nonlinear_system
    from .linear.frequency_response import stepped_sine
    from .loop.rig_variations import RIG_SET, variation, with_delay
    from .loop.scenarios import SCENARIOS, Scenario
    from .notebook.benchmark import Benchmark, benchmark
    from .notebook.closed_loop import ClosedLoop
    from .notebook.commands import (
        bench,
        capability,
        coefficients,
        commission,
        compare,
        drive,
        excite,
        fmu,
        force_test,
        frequency,
        import_,
        jack_model,
        learn,
        limit,
        new_rig,
        record,
        spread,
        time,
        train,
        valve_test,
        watch,
    )
    from .notebook.judgements import faults, inverse, robustness, sines
    from .notebook.search import tune
    from .notebook.studies import fit, plan, residual, retune, run, trace
    from .notebook.time_response import TimeResponse
    from .plant import Plant, build, build_force_port
    from .plant.effects import Effect, known_effects
    from .records import Campaign, Record, load_campaign, read_record
    from .records.frequency_sheet import read_sheet
    from .report import Curve, Figure, Panel, Table
    from .rigs.linear_system import linear_plant
    from .rigs.rig import Rig
    from .rigs.rig_file import load_rig, save_rig

_HOMES = {
    "base.errors": ("InputError",),
    "base.signals": ("SIGNALS",),
    "base.trust": ("trust",),
    "base.units": ("from_si", "quantity", "to_si"),
    "control.controller_spec": ("ControllerSpec",),
    "control.controller_type": ("controller",),
    "control.fractional": ("FractionalTransferFunction", "fit_fractional"),
    "control.protocol": ("Controller", "design_numbers", "number"),
    "engine": ("Engine", "Trajectory"),
    "linear": ("Equilibrium", "discretise", "equilibrium", "linearise", "nonlinear_system"),
    "linear.frequency_response": ("stepped_sine",),
    "loop.rig_variations": ("RIG_SET", "variation", "with_delay"),
    "loop.scenarios": ("SCENARIOS", "Scenario"),
    "notebook.benchmark": ("Benchmark", "benchmark"),
    "notebook.closed_loop": ("ClosedLoop",),
    "notebook.commands": (
        "bench",
        "capability",
        "coefficients",
        "commission",
        "compare",
        "drive",
        "excite",
        "fmu",
        "force_test",
        "frequency",
        "import_",
        "jack_model",
        "learn",
        "limit",
        "new_rig",
        "record",
        "spread",
        "time",
        "train",
        "valve_test",
        "watch",
    ),
    "notebook.judgements": ("faults", "inverse", "robustness", "sines"),
    "notebook.search": ("tune",),
    "notebook.studies": ("fit", "plan", "residual", "retune", "run", "trace"),
    "notebook.time_response": ("TimeResponse",),
    "plant": ("Plant", "build", "build_force_port"),
    "plant.effects": ("Effect", "known_effects"),
    "records": ("Campaign", "Record", "load_campaign", "read_record"),
    "records.frequency_sheet": ("read_sheet",),
    "report": ("Curve", "Figure", "Panel", "Table"),
    "rigs.linear_system": ("linear_plant",),
    "rigs.rig": ("Rig",),
    "rigs.rig_file": ("load_rig", "save_rig"),
}

__all__ = [
    "RIG_SET",
    "SCENARIOS",
    "SIGNALS",
    "Benchmark",
    "Campaign",
    "ClosedLoop",
    "Controller",
    "ControllerSpec",
    "Curve",
    "Effect",
    "Engine",
    "Equilibrium",
    "Figure",
    "FractionalTransferFunction",
    "InputError",
    "Panel",
    "Plant",
    "Record",
    "Rig",
    "Scenario",
    "Table",
    "TimeResponse",
    "Trajectory",
    "bench",
    "benchmark",
    "build",
    "build_force_port",
    "capability",
    "coefficients",
    "commission",
    "compare",
    "controller",
    "design_numbers",
    "discretise",
    "drive",
    "equilibrium",
    "excite",
    "faults",
    "fit",
    "fit_fractional",
    "fmu",
    "force_test",
    "frequency",
    "from_si",
    "import_",
    "inverse",
    "jack_model",
    "known_effects",
    "learn",
    "limit",
    "linear_plant",
    "linearise",
    "load_campaign",
    "load_rig",
    "new_rig",
    "nonlinear_system",
    "number",
    "plan",
    "quantity",
    "read_record",
    "read_sheet",
    "record",
    "residual",
    "retune",
    "robustness",
    "run",
    "save_rig",
    "sines",
    "spread",
    "stepped_sine",
    "time",
    "to_si",
    "trace",
    "train",
    "trust",
    "tune",
    "valve_test",
    "variation",
    "watch",
    "with_delay",
]


def _shown(value: Any) -> Any:
    """A function that says in one line what it wants, and builds the plant of a rig where it wants a plant."""
    if not isinstance(value, FunctionType):
        return value
    from .notebook.door import shown

    return shown(value)


__getattr__, __dir__ = lazy_names(__name__, _HOMES, _shown)
