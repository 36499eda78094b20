"""`jackbench inverse EXPERIMENT`: on which rigs an inverse is designed, how far it looks ahead, a loop outside it."""

import argparse

from ...base.errors import nearest
from ...base.units import Spec
from ...linear.state_space import StateSpace, state_space, transfer_function, tustin
from ..common.declared import ExperimentFile, declared, part, takes_experiment
from ..common.record_experiment import RecordExperiment


def _designed_on(at: ExperimentFile) -> tuple[str, ...]:
    names = at.top.words("designed_on", "nominal")
    for name in names:
        if name not in at.rigs:
            raise at.top.complaint("designed_on", f'"{name}" is not in the list `rigs`; {nearest(name, at.rigs)}')
    return names


def _preview(at: ExperimentFile) -> int:
    preview = at.top.quantity("preview", Spec("s", 0.0, 10.0, "how far it looks ahead"))
    samples = round(preview / at.rig.period.value)
    if samples >= at.taps:
        raise at.top.complaint("preview", "must be below the length; shorten it")
    return samples


def _taps(at: ExperimentFile) -> int:
    period = at.rig.period.value
    return round(at.top.quantity("length", Spec("s", period, 10.0, "of the filter")) / period)


def _band(at: ExperimentFile) -> float:
    return at.top.quantity("band", Spec("Hz", 1e-3, at.rig.nyquist, "within which references move"))


def _outer(at: ExperimentFile) -> StateSpace | None:
    """The transfer function of a table from a signal to the reference, sampled by Tustin's rule; SI."""
    if "outer" not in at.top:
        return None
    table, rig = at.top.table("outer", "signal", "numerator", "denominator"), at.rig
    signal = table.word("signal", rig.sensors, "force")
    if signal == "force" and not rig.specimen_stiffness:
        raise table.complaint("signal", "a force has nothing to act on; add a table [specimen]")
    numerator, denominator = (table.numbers(key, "[1.0, 20.0, 400.0]") for key in ("numerator", "denominator"))
    if not denominator[0]:
        raise table.complaint("denominator", "begins with 0; begin with the highest power of s that it has")
    if len(numerator) > len(denominator):
        raise table.complaint("numerator", "has a higher power of s than the denominator; shorten it")
    sampled = tustin(transfer_function(numerator, denominator), rig.period.value)
    return state_space(*sampled, rig.period.value, [signal], ["reference"])


@declared
class InverseConfig(RecordExperiment):
    """A record, inverses of loops designed on rigs, and the system from measured signals to the reference.

    preview, taps: samples; band [Hz]: within which references move. `outer` is None where the reference is given.
    """

    KIND = "inverse"
    designed_on: tuple[str, ...] = part(_designed_on, {"designed_on": "rigs of the list"})
    preview: int = part(_preview, {"preview": "how far it looks ahead"})
    taps: int = part(_taps, {"length": "of the filter"})
    band: float = part(_band, {"band": "within which references move"})
    outer: StateSpace | None = part(_outer, {"outer": "from a measured signal to the reference"}, default=None)


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    takes_experiment(
        parser, "an inverse experiment, such as experiments/inverse.toml", InverseConfig, "inverse.study:run_inverse"
    )
