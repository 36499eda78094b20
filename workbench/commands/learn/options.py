"""`jackbench learn EXPERIMENT`: a record that is repeated, how often, and by what the filter is measured."""

import argparse
from functools import partial

from ...base.units import Spec
from ...control.controller_spec import ControllerSpec
from ...records.excitation import MultisineSpec
from ..common.declared import MANY, ExperimentFile, count, declared, part, takes_experiment
from ..common.experiment import load_either, sole_controller
from ..common.record_experiment import MEASURE, RecordExperiment, read_multisine
from .platform_config import PlatformLearnConfig


def _measure(at: ExperimentFile) -> MultisineSpec | None:
    amplitude = Spec(at.signal.si, 1e-9, 1e9, "peak of the multisine")
    there = "measure" in at.top
    return read_multisine(at.top.table("measure"), amplitude, at.rig.nyquist) if there else None


@declared
class LearnConfig(RecordExperiment):
    """A record that a controller repeats at most so often; the filter is that of the first rig.

    With `measure` the filter is made of a measured response, else of the linear loop.
    """

    KIND = "learn"
    controller: ControllerSpec = part(sole_controller, {})
    iterations: int = count(1, MANY, "repetitions, at most")
    measure: MultisineSpec | None = part(_measure, MEASURE)


load_learning = LearnConfig.load


load_any = partial(load_either, LearnConfig, PlatformLearnConfig)  # of one jack or of a platform


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    what = "a learn experiment, such as experiments/learn_sine.toml"
    takes_experiment(parser, what, LearnConfig, "learn.platform:run_any", load_any)
