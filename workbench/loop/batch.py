"""Closed loops in lanes: laws on plants, each with its numbers, place in the stroke and noise."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..control.law import Law
from ..control.protocol import Controller, graph_law
from ..engine import Engine
from ..engine.guard_shape import TRIPS
from ..engine.sampled_law import OUT
from ..linear.equilibria import Equilibria
from ..rigs.rig import Rig
from .compiled_loop import CompiledLaw, compiled_law, with_preview
from .sensors import Sensors, draws

CHUNK = 500  # lanes at a time: what they put out stays in memory, metrics are taken of it, and it is let go


@dataclass(frozen=True)
class BatchRun:
    """What lanes did at k instants: `signals` [lanes, k] by name, commands sent and demanded [lanes, k].

    trip: the number in TRIPS of what tripped each lane's guard, 0 where nothing did. failed: lanes whose simulation
    failed; their signals are NaN from there on. remembered [lanes, m]: what the laws have in their memory at the end,
    None of those without one.
    """

    signals: dict[str, np.ndarray]
    sent: np.ndarray
    demanded: np.ndarray
    trip: np.ndarray
    failed: np.ndarray
    remembered: np.ndarray | None = None

    @classmethod
    def of(
        cls, out: np.ndarray, recorded: tuple[str, ...], failed: np.ndarray, remembered: np.ndarray | None = None
    ) -> "BatchRun":
        """The run in the output of compiled laws [lanes, k, j], whose columns are OUT and then the recorded signals."""
        columns = dict(zip((*OUT, *recorded), np.moveaxis(out, 2, 0), strict=True))
        trip = np.nan_to_num(columns["trip"]).max(axis=1)
        signals = {name: columns[name] for name in recorded}
        return cls(signals, columns["sent"], columns["demanded"], trip, failed, remembered)

    def why(self, lane: int) -> str:
        """What tripped a lane, of TRIPS."""
        return TRIPS[int(self.trip[lane])]


def run_lanes(
    engine: Engine,
    rig: Rig,
    law: Law | Sequence[Law],
    points: Equilibria,
    p: np.ndarray,
    reference: np.ndarray,
    recorded: tuple[str, ...],
    seed: int | None = None,
    inputs: Mapping[str, np.ndarray] | None = None,
    first: int = 0,
    added: np.ndarray | float = 0.0,
) -> Iterator[tuple[slice, BatchRun]]:
    """Loops that start at rest at `points` on plants with parameters p [lanes, j], along deviations `reference` [k].

    Or [lanes, k]. One law for all, or one for each lane, such as designs of one controller: see `compiled_law`. A seed
    switches noise and resolution on, a lane's own by its number, counted from `first`; `inputs` [k]: how far other
    inputs of the plants go from where they are at `points`; `added` [k]: commands on top of what the laws demand.
    Yields chunks of lanes, each as a SampledLoop would have run it; the rig gives limits, sensors and period to all of
    them.
    """
    sensors = Sensors(rig, engine.plant.outputs, seed)
    laws = law if isinstance(law, Sequence) else [law]
    for lanes, chunk in chunks(engine, sensors, points, p, reference, seed, inputs or {}, first):
        ready = compiled_law(engine, rig, laws, sensors, chunk.p, recorded)
        own = laws[lanes] if isinstance(law, Sequence) else laws
        yield lanes, _run_chunk(engine, ready, own, sensors, chunk, added)


def play_lanes(
    engine: Engine, rig: Rig, controller: Controller, *lanes: Any, **rest: Any
) -> Iterator[tuple[slice, BatchRun]]:
    """`run_lanes` of a controller's law. Raises ValueError for one that only computes in Python."""
    law = graph_law(controller)
    if law is None:
        raise ValueError(f"{type(controller).__name__} has no graph, and does not play in lanes")
    return run_lanes(engine, rig, law, *lanes, **rest)


@dataclass(frozen=True)
class LaneChunk:
    """Lanes at rest at `points`, with what happens to them: others [lanes, k, m - 1], inputs but for the commands;
    normal [lanes, k + 1, sensors], what the sensors' noise is made of, first at the start: nothing without a seed.

    outputs [lanes, h]: at the start. reference [lanes, k]: deviations from there.
    """

    points: Equilibria
    p: np.ndarray
    outputs: np.ndarray
    reference: np.ndarray
    others: np.ndarray
    normal: np.ndarray


def chunks(
    engine: Engine,
    sensors: Sensors,
    points: Equilibria,
    p: np.ndarray,
    reference: np.ndarray,
    seed: int | None,
    inputs: Mapping[str, np.ndarray],
    first: int = 0,
) -> Iterator[tuple[slice, LaneChunk]]:
    """The lanes of a run, numbered from `first` for their noise, `CHUNK` at a time."""
    k = reference.shape[-1]
    for begin in range(0, len(p), CHUNK):
        lanes = slice(begin, min(begin + CHUNK, len(p)))
        at = Equilibria(points.x[lanes], points.u[lanes], points.ok[lanes])
        outputs = engine.outputs(at.x[:, None], at.u[:, None], p[lanes, None])[:, 0]
        others = np.repeat(at.u[:, None, 1:], k, axis=1)
        for name, values in inputs.items():
            others[:, :, engine.plant.input(name) - 1] += values
        asked = np.broadcast_to(reference if reference.ndim == 1 else reference[lanes], (len(at.x), k))
        normal = _normal(seed, range(first + lanes.start, first + lanes.stop), (k + 1, len(sensors.names)))
        yield lanes, LaneChunk(at, p[lanes], outputs, asked, others, normal)


def _normal(seed: int | None, lanes: range, shape: tuple[int, int]) -> np.ndarray:
    """What the sensors' noise is made of, [lanes, instants, sensors]: nothing without a seed."""
    if seed is None:
        return np.zeros((len(lanes), shape[0], 0))
    return _drawn(seed, lanes, shape)


@lru_cache(maxsize=2)  # a search draws the same for each design; at rest, and in motion
def _drawn(seed: int, lanes: range, shape: tuple[int, int]) -> np.ndarray:
    drawn = np.stack([draws(seed, lane).standard_normal(shape) for lane in lanes])
    drawn.setflags(write=False)
    return drawn


def _starts(
    laws: Sequence[Law], signals: np.ndarray, commands: np.ndarray
) -> tuple[np.ndarray | Sequence[np.ndarray], np.ndarray]:
    """States and constants of one law for all lanes, or of one for each."""
    if len(laws) == 1:
        return laws[0].starts(signals, commands)
    each = [law.starts(signals[i : i + 1], commands[i : i + 1]) for i, law in enumerate(laws)]
    return [x[0] for x, _ in each], np.concatenate([offset for _, offset in each])


def _run_chunk(
    engine: Engine,
    ready: CompiledLaw,
    laws: Sequence[Law],
    sensors: Sensors,
    chunk: LaneChunk,
    added: np.ndarray | float,
) -> BatchRun:
    plant, points, p, k, measures = engine.plant, chunk.points, chunk.p, chunk.reference.shape[1], laws[0].measures
    readings = sensors.readings(chunk.outputs, chunk.normal[:, 0])
    measured = readings[:, [sensors.names.index(name) for name in measures]]
    signals, commands = np.column_stack((measured[:, 0], measured)), points.u[:, 0]
    x, offset = _starts(laws, signals, commands)
    state = ready.start(x, points.u[:, :1])
    numbers = ready.numbers(laws, offset)
    level = chunk.outputs[:, [plant.output(measures[0])]]
    asked = with_preview(level + chunk.reference, laws[0].preview)
    more = np.broadcast_to(added, asked.shape[:2])[..., None]
    rows = np.concatenate((asked, more, chunk.others, chunk.normal[:, 1:]), axis=2)
    batch, out = engine.run_sampled(ready.shape, points.x, ready.durations, state, rows, numbers, every=k, p=p)
    return BatchRun.of(out, ready.shape.recorded, ~batch.ok, ready.remembered(laws[0], state))
