"""The envelope that a position loop has to hold on: over the stroke, on rigs unlike the nominal one, at the worst of
what is uncertain; its linear loops, and its steps on the nonlinear plant."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from ..control.protocol import Controller, graph_law
from ..engine import Engine
from ..linear import Equilibrium
from ..plant import build
from ..rigs.rig import Rig
from .batch import play_lanes
from .margins import LaneMargins
from .plant_lanes import PlantLanes, drawn_evenly, joined, plant_lanes, uncertain
from .sampled_loop import SampledLoop
from .scenarios import POSITIONS, Scenario
from .sensors import settling_band
from .step_metrics import hunting_lanes, settling_times

HUNTING = 0.002  # of the step, peak to peak over the last 0.3 s: a loop that swings by more hunts
_REST = 0.3  # s: at rest
_LEFT = 0.2, 0.3  # s after it began: what a step or a load has left on the mean between them
DRAWN = 4000  # plants that are drawn: every second at one of the positions, the others anywhere between them


@dataclass(frozen=True)
class LinearWorst:
    """The worst of linear loops at null and moving: the summed growth of the unstable ones [1/period], the largest Ms,
    the least gain margin [dB] (inf where none crosses; both NaN where one is unstable), and the worst plant."""

    growth: float
    ms: float
    gain_margin_db: float
    plant: str

    @classmethod
    def of(cls, lanes: PlantLanes, margins: Sequence[LaneMargins]) -> "LinearWorst":
        """Over lanes of plants, at all their points."""
        radius = np.max([each.radius for each in margins], axis=0)
        growth = np.maximum(radius - (1 - 1e-9), 0.0)
        with np.errstate(invalid="ignore"):
            ms = np.max([each.ms for each in margins], axis=0)
            gain_margin = np.fmin.reduce([each.gain_margin_db for each in margins])
        worst = int(np.argmax(np.where(np.isnan(ms), 1e3 * (1 + growth), ms)))
        if growth.any():
            return cls(float(growth.sum()), np.nan, np.nan, lanes.names[worst])
        least = np.fmin.reduce(gain_margin)
        return cls(0.0, float(ms[worst]), float(np.nan_to_num(least, nan=np.inf)), lanes.names[worst])


@dataclass(frozen=True)
class EnvelopeSteps:
    """A scenario in lanes: settling [s] (NaN: never), overshoot [%], IAE [SI s], peak deviation [SI]; the error `left`
    on the mean from 0.2 to 0.3 s after it began [SI]; what tripped or could not be simulated; what hunts, of a run
    without noise (else all False). remembered [lanes, m]: what the controller has in its memory at the end, None
    without one."""

    names: tuple[str, ...]
    settling: np.ndarray
    overshoot: np.ndarray
    iae: np.ndarray
    peak: np.ndarray
    left: np.ndarray
    tripped: np.ndarray
    hunting: np.ndarray
    remembered: np.ndarray | None


@dataclass(frozen=True)
class Envelope:
    """Variations of a rig at positions over its stroke, `nominal` first; `drawn`: plants drawn over what is uncertain,
    half of them at those positions, none where no factors are given.

    Every plant has the rig's limits, sensors and period.
    """

    rig: Rig
    engine: Engine
    varied: PlantLanes
    nominal: np.ndarray
    drawn: PlantLanes | None

    def corner(self, controller: Controller) -> PlantLanes:
        """The bad corner of all declared bounds, at every position: each number at the end at which Ms is larger."""
        return self._worst_corner(() if self._ends is None else self._ends.margins(controller))

    def margins(self, controller: Controller) -> list[tuple[PlantLanes, Sequence[LaneMargins]]]:
        """Linear loops at null and moving: of the varied plants, of the drawn ones where there are any, and of the bad
        corner. Raises InputError for a controller without a linear view."""
        parts = [part for part in (self.varied, self.drawn, self._ends) if part is not None]
        ends = np.cumsum([len(part.names) for part in parts])
        lanes = np.split(np.arange(ends[-1]), ends[:-1])
        every = self._linear.margins(controller)
        own = [[each.some(some) for each in every] for some in lanes]
        corner = self._worst_corner(() if self._ends is None else own.pop())
        return [*zip(parts, own, strict=False), (corner, corner.margins(controller))]

    def _worst_corner(self, margins: Sequence[LaneMargins]) -> PlantLanes:
        """The corner that the margins of the nominal rig with its numbers at their ends make the worst."""
        ms = np.max([np.nan_to_num(each.ms, nan=np.inf) for each in margins], axis=0) if margins else np.zeros(0)
        return self._corner(tuple((ms[1::2] > ms[::2]).tolist()))

    @cached_property
    def _corner(self) -> Callable[[tuple[bool, ...]], PlantLanes]:
        """The corner of which each number is at its high end, or not; a few are kept, for designs share them."""

        def corner(high: tuple[bool, ...]) -> PlantLanes:
            p, places = self.engine.plant.p.copy(), self._positions
            for (name, ends), end in zip(self._bounds.items(), high, strict=True):
                p[self.engine.plant.parameters.index(name)] = ends[end]
            names = [_named(self.rig, "bad corner", position) for position in places]
            return plant_lanes(self.rig, self.engine, names, np.tile(p, (len(places), 1)), np.array(places))

        return lru_cache(32)(corner)

    @cached_property
    def _bounds(self) -> dict[str, tuple[float, float]]:
        return uncertain(self.rig, self.engine.plant, {})

    @cached_property
    def few(self) -> PlantLanes:
        """The nominal rig all over the stroke, and every variation at mid stroke: for laws that do not run in lanes."""
        middle = self.varied.position == 0
        return self.varied.some(np.flatnonzero(self.nominal | middle).tolist())

    def are_nominal(self, names: Sequence[str]) -> np.ndarray:
        """Which plants [lanes], by name, are those of the nominal rig."""
        return np.isin(names, np.array(self.varied.names)[self.nominal])

    def with_drawn(self, kept: Sequence[int]) -> "Envelope":
        """With some of the drawn plants only."""
        return replace(self, drawn=self.drawn.some(kept) if self.drawn is not None and kept else None)

    def played(self, controller: Controller) -> PlantLanes:
        """The plants on which a controller's motions are judged: in a search that draws plants few for one that does
        not run in lanes, else the same for all."""
        return self._all if self.drawn is None or graph_law(controller) is not None else self.few

    @cached_property
    def _all(self) -> PlantLanes:
        return self.varied if self.drawn is None else joined(self.varied, self.drawn)

    @cached_property
    def _linear(self) -> PlantLanes:
        """All of them, and those at the ends of their bounds, that no linear loop is computed by itself."""
        return self._all if self._ends is None else joined(self._all, self._ends)

    @cached_property
    def _positions(self) -> list[float]:
        return sorted(set(self.varied.position.tolist()))

    @cached_property
    def _ends(self) -> PlantLanes | None:
        """The nominal rig with each number that has bounds at its low and its high end, far out in the stroke."""
        plant = self.engine.plant
        if not self._bounds:
            return None
        ends = [(name, end) for name, pair in self._bounds.items() for end in pair]
        p = np.array([plant.parameter_values(None, **{name: end}) for name, end in ends])
        names = [f"{name} {end:g}" for name, end in ends]
        return plant_lanes(self.rig, self.engine, names, p, np.full(len(ends), self._positions[-1]))


def envelope(
    rigs: Mapping[str, Rig],
    positions: Sequence[float] = POSITIONS,
    factors: Mapping[str, tuple[float, float]] | None = None,
    seed: int = 0,
) -> Envelope:
    """The envelope of rigs by name, the nominal one first, at shares of its stroke limit, with plants that are drawn
    over `factors` and bounds.

    Raises InputError where there is no operating point, ValueError for rigs whose plants differ in more than numbers.
    """
    nominal, *_ = rigs.values()
    engine, plants = Engine(build(nominal)), {name: build(rig) for name, rig in rigs.items()}
    if any(plant.parameters != engine.plant.parameters for plant in plants.values()):
        raise ValueError("rigs of an envelope must differ in numbers only")
    places = [share * nominal.limit("stroke") for share in (positions if nominal.is_jack else (0.0,))]
    lanes = [(name, x) for name in rigs for x in places]
    varied = plant_lanes(
        nominal,
        engine,
        [_named(nominal, name, x) for name, x in lanes],
        np.array([plants[name].p for name, _ in lanes]),
        np.array([x for _, x in lanes]),
    )
    first = next(iter(rigs))
    nominals = np.array([name == first for name, _ in lanes])
    drawn = _drawn(nominal, engine, places, factors, seed) if factors else None
    return Envelope(nominal, engine, varied, nominals, drawn)


def _drawn(
    rig: Rig, engine: Engine, places: Sequence[float], factors: Mapping[str, tuple[float, float]], seed: int
) -> PlantLanes:
    random, plant = np.random.default_rng(seed), engine.plant
    p = np.tile(plant.p, (DRAWN, 1))
    for name, (low, high) in uncertain(rig, plant, factors).items():
        p[:, plant.parameters.index(name)] = drawn_evenly(random, low, high, DRAWN)
    reach, even = max(map(abs, places)), np.arange(DRAWN) % 2 == 0
    position = np.where(even, random.choice(places, DRAWN), random.uniform(-reach, reach, DRAWN))
    return plant_lanes(rig, engine, [_named(rig, f"drawn {i}", x) for i, x in enumerate(position)], p, position)


def _named(rig: Rig, name: str, position: float) -> str:
    """A plant, with its place in the stroke where loops differ over it."""
    return f"{name} at {1e3 * position:+.0f} mm" if rig.is_jack else name


def steps(
    lanes: PlantLanes, controller: Controller, scenario: Scenario, seed: int | None, seconds: float, moves: int = 0
) -> EnvelopeSteps:
    """A scenario of at most so many seconds on every plant, towards the middle of the stroke; without a seed no noise.

    So many `moves` come before a step, to its end and back: it then starts where they end, and one of them that trips
    counts. A controller without a form in lanes runs on one plant after another. What has no operating point counts as
    tripped.
    """
    rig, period = lanes.rig, lanes.rig.period.value
    t = np.arange(round(min(seconds, scenario.duration) / period) + 1) * period
    ends = scenario.size * (np.arange(1, (moves if scenario.moves_alone else 0) + 1) % 2)
    begin, turn = (ends[-1], 1 - 2 * (len(ends) % 2)) if len(ends) else (0.0, 1)
    course = np.append(np.repeat(ends, len(t) - 1), begin + turn * scenario.reference(t))
    inwards = np.where(lanes.position > 0, -1.0, 1.0)[:, None]
    runs = list(_runs(lanes, controller, inwards * course, scenario, t, seed))
    y, tripped, _, remembered = (np.concatenate(part) for part in zip(*runs, strict=True))
    tripped = tripped | ~lanes.null.ok
    moved = turn * (inwards * (y[:, -len(t) :] - y[:, :1]) - begin)
    arrives = scenario.arrives or 0.0
    late = t >= arrives - 1e-9
    band = settling_band(rig, scenario.signal, scenario.size)
    size = scenario.size or band
    settling = settling_times(t[: late.sum()], moved[:, late], np.full(len(y), scenario.size), band)
    off = moved - scenario.reference(t)
    error = np.abs(off)
    calm = hunting_lanes(period, y[:, -len(t) :], size, HUNTING if scenario.size else 1.0)
    return EnvelopeSteps(
        lanes.names,
        np.where(tripped, np.nan, settling),
        np.maximum(np.max(moved / size - 1, axis=1), 0.0) * 100 if scenario.size else np.zeros(len(y)),
        error[:, late].sum(axis=1) * period,
        error[:, late].max(axis=1),
        _left(off, period, arrives),
        tripped,
        calm & ~tripped if seed is None else np.zeros(len(y), bool),
        remembered if remembered.shape[1] else None,
    )


def _left(off: np.ndarray, period: float, arrives: float) -> np.ndarray:
    """What is left [lanes] on the mean a while after `arrives` [s] of errors [lanes, k], or at the end before that."""
    first, last = (round((arrives + after) / period) for after in _LEFT)
    return np.abs(off[:, :last][:, first - last :].mean(axis=1))


def command_noise(lanes: PlantLanes, controller: Controller, signal: str) -> np.ndarray:
    """RMS [lanes] of the command [1] at rest that the sensors' noise puts on it."""
    rest = Scenario("rest", signal, 0.0, _REST)
    t = np.arange(round(_REST / lanes.rig.period.value) + 1) * lanes.rig.period.value
    sent = [part for *_, part, _ in _runs(lanes, controller, np.zeros((len(lanes.p), len(t))), rest, t, 0)]
    return np.std(np.concatenate(sent)[:, len(t) // 3 :], axis=1)


# controlled signal [lanes, k], what tripped [lanes], command [lanes, k], what is remembered [lanes, m]: m may be 0
LaneSignals = Iterator[tuple[np.ndarray, ...]]


def _runs(
    lanes: PlantLanes, controller: Controller, asked: np.ndarray, scenario: Scenario, t: np.ndarray, seed: int | None
) -> LaneSignals:
    """In lanes where the controller has such a form, else one plant after another."""
    inputs, signal = {} if scenario.moves_alone else scenario.inputs(t), scenario.signal
    if graph_law(controller) is None:
        yield from _one_by_one(lanes, controller, asked, signal, inputs, seed)
        return
    for _, done in play_lanes(lanes.engine, lanes.rig, controller, lanes.null, lanes.p, asked, (signal,), seed, inputs):
        kept = np.zeros((len(done.sent), 0)) if done.remembered is None else done.remembered
        yield done.signals[signal], (done.trip > 0) | done.failed, done.sent, kept


def _one_by_one(
    lanes: PlantLanes,
    controller: Controller,
    asked: np.ndarray,
    signal: str,
    inputs: Mapping[str, np.ndarray],
    seed: int | None,
) -> LaneSignals:
    for lane, reference in enumerate(asked):
        plant = replace(lanes.engine.plant, p=lanes.p[lane])
        start = Equilibrium(lanes.null.x[lane], lanes.null.u[lane], 0.0)
        level = float(lanes.engine.observe(start.x, start.u, plant.p)[plant.output(signal)])
        there = {name: start.u[plant.input(name)] + values for name, values in inputs.items()}
        run = SampledLoop(Engine(plant), lanes.rig, controller, start, seed).run(level + reference, there)
        missing = np.full(asked.shape[1] - len(run.record.t), np.nan)
        columns = (np.append(run.record.signals[name], missing)[None] for name in (signal, "command"))
        y, command = columns
        yield y, np.array([run.tripped is not None]), command, np.zeros((1, 0))
