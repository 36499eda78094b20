"""Control laws: what a controller is, and what designs are made of.

protocol, protocol_check    what a controller is, and whether a class is one
controller_spec, load_class    a controller of a config: its class, numbers and compensators
controller_type        the same for Python: a law called with its numbers
compensators           filters and static maps that stack on any controller
around, measured_stiffness    what stands around a controller; force loops scaled by the stiffness that they measure
nominal_jack, mode_meter, mode_law    mass, oil and velocity gain measured as a loop moves; a law scheduled by them
dither                 a sine on top of a controller's command
lane_compensators      the same around a controller in lanes
plan, planned          what a reference goes through that is no filter; a controller within one
reference_plan         a motion planned of a reference, with the command for its flow
automatic_tuning       gains by rules from small moves, without a model
sine_control           amplitude, phase and harmonics of sines corrected as measured
discrete_filter, second_order_sections, section_controller    sampled linear laws
linear_law             sampled linear laws as data, for compiled loops
network, network_file, network_law    trained networks: arrays, their files, what they add to a law
graph_law, by_graph      laws that are not linear as graphs, for compiled loops; controllers of them
piecewise_linear       schedules and maps of the command as graphs
jack_model, inner_loop    the jack as an outer controller sees it
linear_model, linear_observer    a linear plant of the user's own as its designs see it
kalman_observer, mpc_qp, reference_governor    what model-based controllers share
planned_step, planned_law, planned_core, planned_lanes    a predictive law: a sample, its graph, its export, in lanes
crone, fractional      fractional design; fractional systems as objects
platform_controller, platform_law    six laws on the legs or on the modes of a platform; as one graph
scheduled_law, export/  laws with schedules and maps as data; laws for a rig's own digital controller
"""

from typing import TYPE_CHECKING

from ..base.lazy import lazy_names

if TYPE_CHECKING:
    from .compensators import Compensated, Compensator, OnLoadCell
    from .controller_spec import ControllerSpec
    from .controller_type import ControllerType, controller
    from .discrete_filter import Filter, weighted
    from .graph_law import GraphController, GraphLaw
    from .jack_model import JackModel
    from .kalman_observer import JackObserver, ObservedJack
    from .linear_law import LinearLaw
    from .piecewise_linear import CommandMap, PiecewiseLinear
    from .protocol import Controller, design_numbers, linear_view, number
    from .second_order_sections import Factors, SectionFilter
    from .section_controller import SectionController

__all__ = [
    "CommandMap",
    "Compensated",
    "Compensator",
    "Controller",
    "ControllerSpec",
    "ControllerType",
    "Factors",
    "Filter",
    "GraphController",
    "GraphLaw",
    "JackModel",
    "JackObserver",
    "LinearLaw",
    "ObservedJack",
    "OnLoadCell",
    "PiecewiseLinear",
    "SectionController",
    "SectionFilter",
    "controller",
    "design_numbers",
    "linear_view",
    "number",
    "weighted",
]

# The protocol need not wait for any design.
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "compensators": (
            "Compensated",
            "Compensator",
            "OnLoadCell",
        ),
        "controller_spec": ("ControllerSpec",),
        "controller_type": (
            "ControllerType",
            "controller",
        ),
        "discrete_filter": (
            "Filter",
            "weighted",
        ),
        "graph_law": (
            "GraphController",
            "GraphLaw",
        ),
        "jack_model": ("JackModel",),
        "kalman_observer": (
            "JackObserver",
            "ObservedJack",
        ),
        "linear_law": ("LinearLaw",),
        "piecewise_linear": (
            "CommandMap",
            "PiecewiseLinear",
        ),
        "protocol": (
            "Controller",
            "design_numbers",
            "linear_view",
            "number",
        ),
        "second_order_sections": (
            "Factors",
            "SectionFilter",
        ),
        "section_controller": ("SectionController",),
    },
)
