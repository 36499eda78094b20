"""What was played at a live rig, beside the same in simulation."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..loop.rig_variations import with_delay
from ..loop.rows import LinearLoops, LoopSetup, row
from ..loop.sampled_loop import LoopRun
from ..loop.scenarios import Scenario
from ..records import Record
from ..rigs.rig import Rig
from .client import LinkClient
from .course import Played
from .trips import Trip
from .wire_loop import acts_after

_AVERAGED = 8e-3  # s


@dataclass(frozen=True)
class Judged:
    """A controller in a scenario at the rig and in simulation: runs and rows, and
    what tripped it at the rig, if it did."""

    controller: str
    scenario: Scenario
    measured: LoopRun
    predicted: LoopRun
    row: Mapping[str, Any]
    prediction: Mapping[str, Any]
    trip: Trip | None = None


def wire_rig(rig: Rig, client: LinkClient) -> Rig:
    """The rig as a loop behind the link meets it: its commands act as late as they do there."""
    return with_delay(rig, acts_after(client.hello.period, client.hello.lockstep, rig.computing_delay.value))


def judge_played(
    told: tuple[LoopRun, Mapping[str, Any]],
    spec: ControllerSpec,
    scenario: Scenario,
    played: Played,
    setup: LoopSetup,
    loops: LinearLoops,
) -> Judged:
    """What was played at a rig, beside the run and the row that are `told` of it in simulation."""
    record = played.run.record
    run = LoopRun(record, played.run.demanded, played.ended)
    values = _averaged(record.signals[scenario.signal], setup.rig.period.value)
    values[0] = played.level
    calm = replace(run, record=Record("wire", record.t, {**record.signals, scenario.signal: values}))
    own = row(spec, scenario, setup, calm, loops, calm) | {"residual_oscillation": None}  # noise would pass for hunting
    return Judged(spec.name, scenario, run, told[0], own, told[1], played.run.trip)


def _averaged(values: np.ndarray, period: float) -> np.ndarray:
    """A running mean [k] over `_AVERAGED` about each sample: of single readings, one in three hundred is beyond a band
    of three standard deviations."""
    half = round(_AVERAGED / 2 / period)
    padded = np.pad(values, half, mode="edge")
    return np.convolve(padded, np.ones(2 * half + 1) / (2 * half + 1), mode="valid")
