from .compensators import Compensator as Compensator, compensated as compensated, weighted as weighted
from .controller_spec import ControllerSpec as ControllerSpec
from .controller_type import ControllerType as ControllerType, controller as controller
from .jack_model import JackModel as JackModel
from .kalman_observer import JackObserver as JackObserver, ObservedJack as ObservedJack
from .law import Law as Law, LawController as LawController, linear_law as linear_law, static_law as static_law
from .piecewise_linear import CommandMap as CommandMap, PiecewiseLinear as PiecewiseLinear
from .protocol import (
    Controller as Controller,
    design_numbers as design_numbers,
    graph_law as graph_law,
    linear_view as linear_view,
    number as number,
)
from .second_order_sections import Factors as Factors, SectionController as SectionController
from .shell import Shell as Shell, around as around
