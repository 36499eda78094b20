"""Linear model predictive control of any linear plant whose position is all that is measured."""

from typing import ClassVar

import numpy as np

from workbench.control.law import LawController
from workbench.control.linear_model import LinearObserver, ObservedPlant
from workbench.control.mpc_qp import Braking, MpcConstraints, ReferenceGovernor, build_horizon
from workbench.control.planned_law import PlannedLaw, planned_law
from workbench.control.protocol import design_numbers, number
from workbench.rigs.linear_rig import LinearRig

from .lqg import lq_gain


class LinearMpc(LawController):
    """The law of LinearLqg where no limit is near, and the least change of it within the limits where one is.

    Those of the command and its rate are kept; what is beyond those of the position and its speed has a price. It plans
    and governs as Mpc does, without a preview; the governor counts on a plant that brakes with `deceleration`.
    """

    of_linear_plants: ClassVar[bool] = True

    @design_numbers
    class Design(ObservedPlant):
        """Design numbers: what the filter trusts, what an error costs, limits and the plan."""

        error: float = number("m", 1e-9, 1e3, "the position error that costs as much as full command", 0.1)
        command: float = number("1", 0.01, 1.0, "largest command", 1.0)
        command_rate: float = number("1/s", 1e-2, 1e6, "fastest change of the command", 200.0)
        stroke: float = number("m", 1e-6, 100.0, "largest position, either way", 0.24)
        speed: float = number("m/s", 1e-6, 100.0, "largest speed", 5.0)
        deceleration: float = number("m/s^2", 1e-3, 1e4, "with which a motion can be stopped within the stroke", 10.0)
        horizon: float = number("s", 1e-3, 100.0, "how far a plan looks ahead", 0.08)
        moves: float = number("1", 1.0, 50.0, "changes c in a plan, the later the longer", 14.0)
        iterations: float = number("1", 10.0, 1e4, "cap on the solver's iterations", 100.0)

    def __init__(self, design: Design, period: float, plant: LinearRig) -> None:
        d, observer = design, LinearObserver(plant, design, period)
        law = observer.state_law(lq_gain(observer, d.error))
        limits = MpcConstraints(d.command, d.command_rate * period, d.stroke, d.speed, np.inf)
        samples = max(1, round(d.horizon / period))
        feedforward = np.full((samples, 1), law.follow)
        governor = ReferenceGovernor(observer, law.feedback, feedforward, Braking(d.stroke, d.speed, d.deceleration))
        horizon = build_horizon(observer, law.feedback, limits, samples, round(d.moves))
        planned = PlannedLaw(observer, law, feedforward, governor, horizon, limits, round(d.iterations))
        super().__init__(planned_law(planned, period))
