from .corners import FigureErrors as FigureErrors, corner_frequencies as corner_frequencies, rated_flow as rated_flow
from .corrector import Corrected as Corrected, Maker as Maker, SpoolLoop as SpoolLoop
from .valve_fit import (
    ValveFit as ValveFit,
    fit_three_stage as fit_three_stage,
    second_order_numbers as second_order_numbers,
    source_of as source_of,
)
