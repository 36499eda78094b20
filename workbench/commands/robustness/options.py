"""`jackbench robustness EXPERIMENT`: controllers, a step, and how far the rig's numbers are drawn."""

import argparse
from functools import partial

import numpy as np

from ...base.signals import Signal
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec
from ...loop.platform.steps import AxisStep, PlatformDraw
from ...loop.rig_variations import ALL, Conditions, Factors, known_to
from ...loop.robustness.problem import RobustnessProblem
from ...loop.scenarios import POSITIONS
from ...rigs.platform import AXES
from ...rigs.rig import Rig
from ..common.declared import Experiment, ExperimentFile, count, declared, fraction, part, quantity, takes_experiment
from ..common.envelope_keys import MOST_MOVES, MOST_PLANTS, WITHIN, read_ends, read_factors, read_positions
from ..common.experiment import (
    CONDITIONS,
    CONTROLLERS,
    RIG,
    SPECIMEN,
    controlled,
    load_either,
    on_specimen,
    read_conditions,
    read_controllers,
)
from ..common.platform_experiment import PlatformExperiment, read_steps

_STEPS = {"m": (1e-6, 1.0), "N": (1.0, 1e9)}  # by the SI unit of the signal
_ANY_STEP = 1e-12, 1e12
_SHIFT = Spec("m", 0.0, 10.0, "how far the centre of mass is drawn")
_WAY = (Spec("m", 0.0, 10.0, "how far poses are drawn"), Spec("rad", 0.0, 1.5, "how far poses are drawn"))


def _known(at: ExperimentFile) -> tuple[Rig, Factors]:
    """The rig and the factors on its numbers, each known to the share of its range that the file says."""
    rig = on_specimen(at)
    factors = read_factors(at.top, rig)
    if "known" not in at.top:
        return rig, factors
    known = at.top.positive("known", "%")
    if known > ALL:
        raise at.top.complaint("known", f"at most {ALL:g}: to +- so many percent of its range each number is known")
    return known_to(rig, factors, known / 100)


def _signal(at: ExperimentFile) -> Signal:
    """The signal that all controllers control. Raises InputError for different ones, or a force on nothing."""
    first, *others = at.controllers
    name = controlled(at, first)
    for spec in others:
        if (other := controlled(at, spec)) != name:
            what = f"{spec.name} controls the {other}, {first.name} the {name}; make two experiments"
            raise at.top.complaint("from", what)
    if name == "force" and not at.rig.specimen_stiffness:
        raise at.top.complaint("specimen", "a force needs something to act on; add a table [specimen]")
    return at.rig.signal(name)


def _step(at: ExperimentFile) -> float:
    si = at.signal.si
    return at.top.quantity("step", Spec(si, *_STEPS.get(si, _ANY_STEP), "size of the step"))


@declared
class RobustnessConfig(RobustnessProblem, Experiment):
    """A robustness experiment on one jack."""

    KIND = "robustness"
    rig: Rig = part(lambda at: _known(at)[0], RIG | SPECIMEN)
    plants: int = count(1, MOST_PLANTS, "plants to draw", asked=True)
    conditions: Conditions = part(read_conditions, CONDITIONS)
    signal: Signal = part(_signal, {})
    step: float = part(_step, {"step": "a length or a force, as the controllers control"})
    seconds: float = quantity("s", 0.5, 60.0, "how long it is watched")
    stroke: float = fraction("of the stroke limit in which steps lie")
    positions: tuple[float, ...] = part(
        lambda at: read_positions(at.top),
        {"positions": "shares of the stroke limit at which linear loops are judged; five without"},
        default=POSITIONS,
    )
    factors: Factors = part(
        lambda at: _known(at)[1],
        {**WITHIN, "known": "to +- so many percent of its range each number of the rig is known; all of it without"},
    )
    controllers: tuple[ControllerSpec, ...] = part(read_controllers, CONTROLLERS)
    moves: int = count(
        0,
        MOST_MOVES,
        "steps, there and back, before the one that is judged; each lasts as long; none without",
        default=0,
    )


def _draw(at: ExperimentFile) -> PlatformDraw:
    payload, pose = at.top.table("payload", "mass", "centre"), at.top.table("pose", *AXES)
    way = np.array([pose.quantity(axis, _WAY[i // 3]) if axis in pose else 0.0 for i, axis in enumerate(AXES)])
    mass, centre = read_ends(payload, "mass"), payload.quantity("centre", _SHIFT)
    return PlatformDraw(mass, centre, way, read_factors(at.top, at.rig.legs[0].rig))


@declared
class PlatformRobustness(PlatformExperiment):
    """Steps by controllers on `plants` platforms, drawn by the seed of the `conditions`."""

    KIND = "robustness"
    plants: int = count(1, MOST_PLANTS, "platforms to draw", asked=True)
    steps: tuple[AxisStep, ...] = part(read_steps, {"scenarios": "steps along axes of the pose"})
    draw: PlatformDraw = part(_draw, {"payload": "how its mass is drawn", "pose": "either way from home", **WITHIN})


load_any = partial(load_either, RobustnessConfig, PlatformRobustness)  # of one jack or of a platform


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    takes_experiment(
        parser,
        "a robustness experiment, such as experiments/robustness.toml",
        RobustnessConfig,
        "robustness.platform_study:run_any",
        load_any,
        shared=True,
    )
