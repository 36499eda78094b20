"""A course at a live rig: to where it starts, standing there, what is played, and back to where the rig stood; and what
was played, beside the same in simulation.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..control.protocol import Controller
from ..loop.rig_variations import with_delay
from ..loop.rows import LinearLoops, LoopSetup, row
from ..loop.sampled_loop import LoopRun
from ..loop.scenarios import Scenario
from ..records import Record
from ..rigs.rig import Rig
from .client import LinkClient
from .trips import Trip
from .wire_loop import WireLoop, WireRun, acts_after, stands

_STANDS = 0.4  # s before and after a course, of which the later half says where it stands
_PATIENCE = 6  # times that long, until a jack that was moved to its start no longer creeps there
_CREEPS = 4.0  # standard deviations of the sensor's mean over half of that
_REST = 1.0  # s of a record at rest
_SPEED = 0.05  # of the speed limit, on the way to a start
_FORCE_TIME = 1.0  # s, to bring a force back
_AVERAGED = 8e-3  # s


@dataclass(frozen=True)
class PlayedCourse:
    """A course as played: the run, the `level` of the controlled signal before it (SI), and the whole recordings, of
    standing and course and of the way back. `ended`: why it was cut short; `lost`: whether that was the link;
    `seconds`: what all of it took; `trip`: what tripped it, if it did, and `mark`: when
    [s] of the record."""

    run: WireRun
    level: float
    record: Record
    back: Record | None
    ended: str | None
    lost: bool
    seconds: float
    trip: Trip | None = None
    mark: float | None = None


def rest_record(client: LinkClient, rig: Rig) -> Record:
    """The rig at rest for a second: on, at command 0."""
    reading, run = stands(client, rig), WireRun(client.hello.period, client.hello.names)
    for _ in range(round(_REST / run.period)):
        run.keep(reading, 0, 0.0, 0.0, 0.0)
        reading = client.exchange((0.0,))
        for each in client.passed:  # that came while this machine was busy
            run.keep(each, 0, 0.0, 0.0, 0.0)
    client.off()
    record = run.record
    signals = {name: values for name, values in record.signals.items() if name != "reference"}
    return Record("static", record.t, signals, record.valid)


def play_course(
    client: LinkClient,
    rig: Rig,
    controller: Controller,
    reference: np.ndarray,
    start: float | None,
    added: np.ndarray | None = None,
    noisy: bool = True,
    begins: Callable[[], None] = lambda: None,
    name: str = "the motion",
) -> PlayedCourse:
    """From where the rig stands to `start` of the controlled signal (SI), None for where it stands, and from there,
    once it no longer creeps and `begins`, along deviations `reference` [k] from it, with a command `added` [k]; then
    back. `name`: of the motion."""
    loop = WireLoop(client, rig, controller, noisy)
    signal, period = controller.measures[0], rig.period.value
    home, stand = loop.level, round(_STANDS / period)
    patience = 1 if start is None else _PATIENCE
    start = home if start is None else start
    runs: list[WireRun] = []
    waited = 0
    try:
        runs.append(loop.run(ramp(rig, signal, home, start), motion=f"the way to {name}"))
        if runs[-1].ended is None:
            runs.append(loop.run(np.full(stand, start), motion=f"the rest before {name}"))
        while len(runs) > 1 and waited + 1 < patience and _creeps(runs[1], rig, signal):
            waited += 1
            runs[1] = loop.run(np.full(stand, start), motion=f"the rest before {name}")
        standing = runs[-1]
        level = _level(standing, signal, home)
        if standing.ended is None:
            begins()
            runs.append(loop.run(start + reference, added, name))
            if runs[-1].ended is None:
                back = ramp(rig, signal, float(runs[-1].rows[-1][1]), home)
                runs.append(loop.run(np.append(back, np.full(stand, home)), motion=f"the way back from {name}"))
    finally:
        loop.end()
    whole = joined(runs[1:3] or runs)
    back = runs[3].record if len(runs) > 3 else None
    seconds = (sum(len(run.rows) for run in runs) + waited * stand) * period
    run, last = runs[min(2, len(runs) - 1)], runs[-1]
    mark = None if run.trip is None else run.trip.t + float(whole.t[-1] - run.record.t[-1])
    return PlayedCourse(run, level, whole, back, last.ended, last.lost, seconds, last.trip, mark)


def ramp(rig: Rig, signal: str, first: float, last: float) -> np.ndarray:
    """A slow way of the controlled signal [k] from one value to another, with no jump of speed."""
    period = rig.period.value
    seconds = abs(last - first) / (_SPEED * rig.limit("speed")) if signal == "position" else _FORCE_TIME
    s = np.arange(1, max(2, round(1.5 * seconds / period)) + 1) * 1.0
    s /= s[-1]
    return first + (last - first) * s * s * (3 - 2 * s)


def joined(runs: Sequence[WireRun]) -> Record:
    """Runs one after the other as one recording."""
    records, begins, names = [run.record for run in runs], [0.0], runs[0].record.names
    for run in runs:
        begins.append(begins[-1] + (run.rows[-1][0] + 1) * run.period if run.rows else begins[-1])
    t = np.concatenate([record.t + begin for record, begin in zip(records, begins, strict=False)])
    signals = {name: np.concatenate([record.signals[name] for record in records]) for name in names}
    valid = {name: np.concatenate([record.valid[name] for record in records]) for name in names}
    return Record("wire", t, signals, valid)


def _creeps(run: WireRun, rig: Rig, signal: str) -> bool:
    """Whether the controlled signal's mean over the later half of a whole run is another than over the first."""
    sensor, half = rig.sensors.get(signal), len(run.rows) // 2
    if run.ended is not None or sensor is None or half == 0:
        return False
    values = run.record.signals[signal]
    noise = _CREEPS * sensor.noise * np.sqrt(2 / half) + sensor.resolution
    return abs(float(values[half:].mean() - values[:half].mean())) > noise


def _level(run: WireRun, signal: str, else_: float) -> float:
    """The mean at which the controlled signal stands, over the later half of a run."""
    values = run.record.signals[signal]
    return float(values[len(values) // 2 :].mean()) if len(values) else else_


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
    played: PlayedCourse,
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
