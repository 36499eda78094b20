"""The file of an inverse: on which rigs it is designed, how far it looks ahead, and a loop outside of it."""

from dataclasses import dataclass
from pathlib import Path

from ...base.errors import nearest
from ...base.table import ConfigTable
from ...base.units import Spec
from ...linear.state_space import StateSpace, state_space, transfer_function, tustin
from ...rigs.rig import Rig
from ..common.record_experiment import RecordExperiment, read_record_experiment


@dataclass(frozen=True)
class InverseConfig:
    """A record, inverses of loops on the rigs `over`, and the system from measured signals to the reference.

    preview, taps: samples; band [Hz]: within which references move. `outer` is None where the reference is given.
    """

    record: RecordExperiment
    over: tuple[str, ...]
    preview: int
    taps: int
    band: float
    outer: StateSpace | None


def load_inverse(path: str | Path, rig: str | None = None, plants: int | None = None) -> InverseConfig:
    """Read the file; `rig` and `plants` replace what it says. Raises InputError with file and key."""
    further = ("over", "preview", "length", "band", "outer")
    top, record = read_record_experiment(Path(path), rig, plants, "inverse", *further)
    over = top.words("over", "nominal")
    for name in over:
        if name not in record.rigs:
            raise top.complaint("over", f'"{name}" is not in the list `rigs`; {nearest(name, record.rigs)}')
    period = record.rig.period.value
    preview, length = (
        round(top.quantity(key, Spec("s", low, 10.0, meaning)) / period)
        for key, low, meaning in (("preview", 0.0, "how far it looks ahead"), ("length", period, "of the filter"))
    )
    if preview >= length:
        raise top.complaint("preview", "must be below the length; shorten it")
    band = top.quantity("band", Spec("Hz", 1e-3, record.rig.nyquist, "within which references move"))
    outer = _outer(top.table("outer"), record.rig, period) if "outer" in top else None
    return InverseConfig(record, over, preview, length, band, outer)


def _outer(table: ConfigTable, rig: Rig, period: float) -> StateSpace:
    """The transfer function of a table from a signal to the reference, sampled by Tustin's rule; SI."""
    table.allow("signal", "numerator", "denominator")
    signal = table.word("signal", rig.sensors, "force")
    if signal == "force" and not rig.specimen_stiffness:
        raise table.complaint("signal", "a force has nothing to act on; add a table [specimen]")
    numerator, denominator = (table.numbers(key, "[1.0, 20.0, 400.0]") for key in ("numerator", "denominator"))
    if not denominator[0]:
        raise table.complaint("denominator", "begins with 0; begin with the highest power of s that it has")
    if len(numerator) > len(denominator):
        raise table.complaint("numerator", "has a higher power of s than the denominator; shorten it")
    sampled = tustin(transfer_function(numerator, denominator), period)
    return state_space(*sampled, period, [signal], ["reference"])
