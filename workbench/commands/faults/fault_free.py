"""Loops without a fault on drawn plants: every trip of the guard is a false one."""

from collections import Counter
from collections.abc import Mapping

import numpy as np

from ...control.protocol import Controller
from ...engine.guard_shape import TRIPS
from ...linear.equilibria import equilibria
from ...linear.operating_point import far_end
from ...loop.batch import play_lanes
from ...loop.fault_trial import FaultTrial, FaultTrials
from ...loop.robustness.drawn_plants import draw_plants

FAILED = "simulation"  # beside what tripped: the plant could not be simulated, which is no trip


def tripped(trips: Mapping[str, int]) -> int:
    """How many of the plants the guard tripped."""
    return sum(count for what, count in trips.items() if what != FAILED)


def false_trips(trials: FaultTrials, trial: FaultTrial, controller: Controller) -> Mapping[str, int]:
    """How many of the plants tripped the guard in the step, by what tripped it; FAILED where it failed."""
    loops, plant = trial.loops, trial.engine.plant
    reach = trials.stroke * trial.rig.limit("stroke")
    span = (-reach, reach - loops.step) if loops.signal == "position" else (-reach, reach)
    draw = draw_plants(trial.rig, plant, loops.factors, trials.plants, trials.conditions.seed, span)
    points = equilibria(plant, draw.p, draw.position, None, None, **far_end(plant, draw.position))
    reference = np.full(round(trials.seconds / trial.rig.period.value), loops.step)
    trips: Counter[str] = Counter()
    played = play_lanes(
        trial.engine, trial.rig, controller, points, draw.p, reference, (loops.signal,), trials.conditions.noise
    )
    for _, lanes in played:
        trips.update(
            FAILED if failed else TRIPS[int(trip)] for trip, failed in zip(lanes.trip, lanes.failed, strict=True)
        )
    return {name: count for name, count in sorted(trips.items()) if name}
