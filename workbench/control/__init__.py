"""Control laws: what a controller is, and what designs are made of.

protocol               what a controller is
controller_spec, load_class    a controller of a config: its class, numbers and compensators
controller_type        the same for Python: a law called with its numbers
compensators           filters that stack on any controller
discrete_filter, second_order_sections, section_controller    sampled linear laws
linear_law             sampled linear laws as data, for compiled loops
jack_model, inner_loop    the jack as an outer controller sees it
kalman_observer, mpc_qp    what model-based controllers share
crone                  fractional design
export                 coefficients for a rig's own digital controller
"""

from typing import TYPE_CHECKING

from ..base.lazy import lazy_names

if TYPE_CHECKING:
    from .compensators import Compensated, Compensator, OnLoadCell
    from .controller_spec import ControllerSpec
    from .controller_type import ControllerType, controller
    from .discrete_filter import Filter, weighted
    from .jack_model import JackModel
    from .kalman_observer import JackObserver, ObservedJack
    from .linear_law import LinearLaw
    from .protocol import Controller, design_numbers, linear_view, number
    from .second_order_sections import Factors, SectionFilter
    from .section_controller import SectionController

__all__ = [
    "Compensated",
    "Compensator",
    "Controller",
    "ControllerSpec",
    "ControllerType",
    "Factors",
    "Filter",
    "JackModel",
    "JackObserver",
    "LinearLaw",
    "ObservedJack",
    "OnLoadCell",
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
        "jack_model": ("JackModel",),
        "kalman_observer": (
            "JackObserver",
            "ObservedJack",
        ),
        "linear_law": ("LinearLaw",),
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
