"""The file of a learning experiment: what is repeated how often, and by what the filter is measured."""

from dataclasses import dataclass
from pathlib import Path

from ...base.units import Spec
from ...control.controller_spec import ControllerSpec
from ...records.excitation import MultisineSpec
from ..common.experiment import on_platform, read_experiment
from ..common.record_experiment import RecordExperiment, read_multisine, read_record_experiment
from .platform_config import PlatformLearnConfig, platform_learning


@dataclass(frozen=True)
class LearnConfig:
    """A record that a controller repeats at most so often; the filter is that of the first rig.

    With `measure` the filter is made of a measured response, else of the linear loop.
    """

    record: RecordExperiment
    controller: ControllerSpec
    iterations: int
    measure: MultisineSpec | None


def load_any(path: str | Path, rig: str | None = None, plants: int | None = None) -> LearnConfig | PlatformLearnConfig:
    """Read the file, of one jack or of a platform; `rig` and `plants` replace what it says. Raises InputError with file
    and key."""
    path = Path(path)
    top = read_experiment(path)
    if on_platform(top, path, rig):
        return platform_learning(top, path, rig, plants)
    return load_learning(path, rig, plants)


def load_learning(path: str | Path, rig: str | None = None, plants: int | None = None) -> LearnConfig:
    """Read the file; `rig` and `plants` replace what it says. Raises InputError with file and key."""
    top, record = read_record_experiment(Path(path), rig, plants, "learn", "iterations", "measure")
    controller, *more = record.controllers
    if more:
        raise top.complaint("controllers", f"{1 + len(more)} of them; name one here or under [from]")
    amplitude = Spec(record.signal.si, 1e-9, 1e9, "peak of the multisine")
    measure = read_multisine(top.table("measure"), amplitude, record.rig.nyquist) if "measure" in top else None
    return LearnConfig(record, controller, top.count("iterations"), measure)
