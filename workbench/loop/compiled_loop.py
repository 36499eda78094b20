"""Closed loops, compiled: the plant, a law, and the guard in one run of the engine."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..control.law import Law
from ..engine import Engine, LaneDelays
from ..engine.guard_shape import length, packed
from ..engine.sampled_law import LawShape
from ..plant import Plant
from ..rigs.rig import Rig
from .guard_numbers import guard_numbers, guard_shape, trip_reason
from .sensors import Sensors


@dataclass(frozen=True)
class CompiledLaw:
    """A law with its guard, drive and sensors, ready to run on a plant: what decides the machine code, and numbers.

    durations [1 or 2] or [lanes, 2]: of the intervals of a period, [s], where a command arrives inside it. `delays`:
    those of the lanes. guard, noise, resolution: numbers [k] of each jack's guard and sensors, one jack after the
    other; coupling [k]: what the legs of a platform do to each other.
    """

    shape: LawShape
    durations: np.ndarray
    guard: np.ndarray
    delays: LaneDelays
    noise: np.ndarray
    resolution: np.ndarray
    coupling: np.ndarray | None = None

    def numbers(self, laws: Sequence[Law], offset: np.ndarray) -> np.ndarray:
        """The parameters [lanes, k] of one law for all lanes or one for each, with their constants o [lanes]."""
        return self.parameters(np.array([law.dense(self.states).numbers for law in laws]), offset[:, None])

    def parameters(self, q: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """The parameters [lanes, k] of numbers q [lanes, j] and constants o [lanes, jacks] of laws."""
        return packed(
            self.shape.numbers,
            q=q,
            offset=offset,
            guard=self.guard,
            **({} if self.coupling is None else {"coupling": self.coupling}),
            part=self.delays.part[:, None] if self.shape.own_delays else self.delays.part[0],
            taps=self.delays.taps(self.shape.late),
            noise=self.noise,
            resolution=self.resolution,
        )

    def start(self, states: np.ndarray | Sequence[np.ndarray], command: np.ndarray) -> np.ndarray:
        """The state [lanes, k] at the start: states [n] of the laws, the drives holding commands [lanes, jacks]."""
        lanes, law = len(states), np.zeros((len(states), self.states))
        for own, x in zip(law, states, strict=True):
            own[: len(x)] = x
        return packed(
            self.shape.state,
            held=command,
            line=np.tile(command, self.shape.late + 1),
            command=command,
            guard=np.zeros((lanes, self.shape.jacks * length(self.shape.guard.state))),
            law=law,
        ).copy()

    @property
    def states(self) -> int:
        """The number of the law's states."""
        return self.shape.graphs.states

    def remembered(self, law: Law, state: np.ndarray) -> np.ndarray | None:
        """What a law has in its memory [lanes, m], of the state [lanes, k]; None of one without a memory."""
        return state[:, self.shape.state["law"]][:, list(law.memory)] if law.memory else None


def compiled_law(
    engine: Engine,
    rig: Rig,
    laws: Sequence[Law],
    sensors: Sensors,
    p: np.ndarray,
    recorded: tuple[str, ...] = (),
) -> CompiledLaw:
    """Laws of one form on plants with parameters p [lanes, j], with a rig's limits and sensors; `recorded` outputs are
    put out at each instant.

    Raises ValueError for laws that differ in what they measure, or in their graphs.
    """
    law, states = laws[0], max(each.states for each in laws)
    graphs = {each.dense(states).graphs for each in laws}
    if len(graphs) > 1 or any(each.measures != law.measures for each in laws):
        raise ValueError("laws in lanes must measure the same signals and have the same graphs")
    (graph,), guard = graphs, guard_shape(rig, sensors.names, law.measures)
    shape = LawShape(graph, law.measures, sensors.names, guard, law.preview, noisy=sensors.noisy, recorded=recorded)
    places = [sensors.names.index(name) for name in shape.read]
    limits = packed(guard.numbers, **guard_numbers(rig, guard, law.measures, sensors.noisy))
    numbers = limits, sensors.noise[places], sensors.resolution[places]
    return with_drives(engine.plant, p, rig.period.value, shape, *numbers)


def with_drives(
    plant: Plant,
    p: np.ndarray,
    period: float,
    shape: LawShape,
    guard: np.ndarray,
    noise: np.ndarray,
    resolution: np.ndarray,
    coupling: np.ndarray | None = None,
) -> CompiledLaw:
    """A law of this shape where drives hold its commands as late as plants with parameters p [lanes, j] say."""
    delays = LaneDelays.of(plant.lane_lateness(p), period)
    late, part, split = int(delays.whole.max()), delays.part[0], bool(delays.part.any()) and not plant.interpolated
    shape = replace(shape, late=late, split=split, interpolated=plant.interpolated, own_delays=delays.differ)
    durations = np.array([part, 1 - part] if split else [1.0]) * period
    durations = delays.durations(period) if split and delays.differ else durations
    return CompiledLaw(shape, durations, guard, delays, noise, resolution, coupling)


def with_preview(reference: np.ndarray, ahead: int) -> np.ndarray:
    """References [.., k] with those to come at each sample [.., k, 1 + ahead]; the last one stays."""
    known = np.concatenate((reference, np.repeat(reference[..., -1:], ahead, axis=-1)), axis=-1)
    return np.lib.stride_tricks.sliding_window_view(known, 1 + ahead, axis=-1)


@dataclass(frozen=True)
class LoopSamples:
    """What happened at k sampling instants: states of the plant x [k + 1, n]; commands sent, demanded and held [k].

    trip: why the guard tripped, or None. failed: the instant after which the simulation failed, or None. fallbacks: in
    how many samples since the start a solver did not arrive, None of a law without one.
    """

    x: np.ndarray
    sent: np.ndarray
    demanded: np.ndarray
    held: np.ndarray
    trip: str | None
    failed: int | None
    fallbacks: int | None


class CompiledLoop:
    """One loop, its law ready to run, numbers [1, k] and state [1, k] of it; each `run` goes on where the last ended,
    and raises InputError where the plant takes absurdly many steps of integration.

    signals: (r, y) as measured at the start, where the drive holds the inputs u [m].
    """

    def __init__(
        self, engine: Engine, rig: Rig, law: Law, sensors: Sensors, u: np.ndarray, signals: np.ndarray
    ) -> None:
        self._engine, self._rig, self._sensors = engine, rig, sensors
        self.law = compiled_law(engine, rig, [law], sensors, engine.plant.p[None])
        x, offset = law.starts(signals[None], u[:1])
        self._sampled = law  # with all that its numbers refer to
        self.numbers, self.state = self.law.numbers([law], offset), self.law.start(x, u[None, :1])

    def run(self, x: np.ndarray, reference: np.ndarray, added: np.ndarray, others: np.ndarray) -> LoopSamples:
        """From the state x [n], along a reference [k], a command that is added to the law's, added [k], and the plant's
        inputs but for the command, others [k, m - 1]."""
        law = self.law
        ahead = with_preview(reference, law.shape.ahead)
        rows = np.column_stack((ahead, added, others, self._sensors.noise_rows(len(reference))))[None]
        batch, out = self._engine.run_sampled(law.shape, x[None], law.durations, self.state, rows, self.numbers)
        failed = int(batch.failed[0])
        if failed >= 0:
            self._engine.check_pace(int(batch.attempts[0]), (failed + 1) * self._rig.period.value)
        sent, demanded, held, trips = out[0].T
        trip = int(trips[failed])  # the last where nothing failed: -1
        reason = trip_reason(self._rig, trip) if trip else None
        return LoopSamples(batch.x[0], sent, demanded, held, reason, None if failed < 0 else failed, self._fallbacks())

    def _fallbacks(self) -> int | None:
        place = self._sampled.fallbacks
        return None if place is None else int(self.state[0, self.law.shape.state["law"]][place])
