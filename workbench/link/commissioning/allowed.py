"""The plants that a rig's bounds, or what was recorded so far, allow, and what they take: every motion at a live rig is
played on all of them first."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from ...base.errors import InputError
from ...base.units import from_si
from ...control.controller_spec import ControllerSpec
from ...control.protocol import Controller, graph_law
from ...engine import Engine
from ...linear import Equilibrium
from ...loop.batch import run_lanes
from ...loop.drive_simulation import SMALLER, TRIES, beyond, drive, emptied, wave_with_end, with_end
from ...loop.envelope import steps
from ...loop.guard_numbers import trip_reason
from ...loop.plant_lanes import PlantLanes, drawn_evenly, plant_lanes, uncertain
from ...loop.sampled_loop import SIMULATION_FAILED, LoopRun, SampledLoop
from ...loop.scenarios import Scenario
from ...loop.standard_records import standard_set
from ...plant import build
from ...plant.effects import numbers_of
from ...records.excitation import Excitation
from ...rigs.number import Number
from ...rigs.rig import Rig

_AS = "-as-"  # between a scenario's name and its smaller size
DRAWN = 60  # beside the corners
_WORST = ("M", "beta", "Ps", "K3")  # whose ends decide how far, how fast and how hard a motion goes
_RECORDED = ("position", "velocity", "force", "pa", "pb", "lowest_pressure")
_DOUBT = 1.2  # of the travel that the datasheet's flow says


@dataclass(frozen=True)
class _Seen:
    """Signals [lanes, k] of plants from the `first` on, and which of them trips or fails, and why, if one does."""

    signals: Mapping[str, np.ndarray]
    first: int = 0
    tripped: tuple[str, int] | None = None


@dataclass(frozen=True)
class ExpectedStep:
    """Between what 95 % of plants lie, SI and %: the end of a settling that some never reach is None. None in all where
    nothing is uncertain, or nothing steps."""

    settling_s: tuple[float, float | None] | None
    overshoot_percent: tuple[float, float | None] | None


@dataclass(frozen=True, eq=False)
class Allowed:
    """A rig and plants of it [lanes] within what is uncertain: the ends of the numbers that decide, in every
    combination, and some `drawn` [lanes] over all; p [lanes, j] are their parameters, the rig's own first."""

    rig: Rig
    engine: Engine
    p: np.ndarray
    drawn: np.ndarray

    def at(self, start: float) -> PlantLanes:
        """Them at rest at a start [m from mid stroke]."""
        if start not in self._places:
            names = [f"plant {lane}" for lane in range(len(self.p))]
            self._places[start] = plant_lanes(self.rig, self.engine, names, self.p, np.full(len(names), start))
        return self._places[start]

    @cached_property
    def _places(self) -> dict[float, PlantLanes]:
        return {}

    def trouble(self, spec: ControllerSpec, reference: np.ndarray, start: float) -> str | None:
        """Why not all of them stay clear of the limits along deviations `reference` [k] from a start [m from mid
        stroke], and on which plant: one trips, or has less than 5 % of a limit left. None where all do."""
        whole = with_end(reference, self.rig.period.value)
        return next(filter(None, map(self._trouble, self._runs(spec, whole, start, np.zeros(len(whole))))), None)

    def trouble_with(self, spec: ControllerSpec, wave: Excitation) -> str | None:
        """What is wrong with an excitation in a loop; nor may a chamber empty, where no model holds that the record is
        to be fitted by."""
        start, wave = float(wave.reference[0]), wave_with_end(wave)
        for seen in self._runs(spec, wave.reference - start, start - self.rig.middle, wave.command):
            if why := self._trouble(seen):
                return why
            if why := emptied(seen.signals):
                return f"{why}{self._with(seen.first + int(seen.signals['lowest_pressure'].min(axis=1).argmin()))}"
        return None

    def stable(self, spec: ControllerSpec) -> "Allowed":
        """Those of them on which a controller that the rig itself gave is stable."""
        null, moving = self.at(0.0).margins(spec.build(self.rig.period.value))
        kept = null.stable & moving.stable
        return replace(self, p=self.p[kept], drawn=self.drawn[kept])

    def expected(self, spec: ControllerSpec, scenario: Scenario) -> ExpectedStep:
        """The time in which 95 % of the drawn plants settle in a step, and their overshoot."""
        lanes = self.at(scenario.position(self.rig.limit("stroke"))).some(np.flatnonzero(self.drawn).tolist())
        if not scenario.is_step or not lanes.names:
            return ExpectedStep(None, None)
        told = steps(lanes, spec.build(self.rig.period.value), scenario, 1, scenario.duration)
        return ExpectedStep(_middle(np.nan_to_num(told.settling, nan=np.inf)), _middle(told.overshoot))

    def _runs(self, spec: ControllerSpec, reference: np.ndarray, start: float, added: np.ndarray) -> Iterator[_Seen]:
        """All of them in lanes; under a controller that computes in Python, those that are not drawn, one by one."""
        lanes, law = self.at(start), graph_law(spec.build(self.rig.period.value))
        if law is None:
            for lane in self.ends:
                loop, level = self.loop(spec.build(self.rig.period.value), lane, start)
                run = loop.run(level + reference, added=added)
                yield _Seen(self._limited(run), lane, (run.tripped, 0) if run.tripped else None)
            return
        own = run_lanes(self.engine, self.rig, law, lanes.null, lanes.p, reference, self._recorded, added=added)
        for where, part in own:
            ended = np.flatnonzero((part.trip > 0) | part.failed)
            lane = int(ended[0]) if len(ended) else 0
            why = trip_reason(self.rig, int(part.trip[lane])) if part.trip[lane] else SIMULATION_FAILED
            yield _Seen(part.signals, where.start, (why, lane) if len(ended) else None)

    def near_limit(self, run: LoopRun, lane: int) -> str | None:
        """Which limit a run of one of them comes too near to, on which plant; None where it stays clear of all."""
        return self._trouble(_Seen(self._limited(run), lane))

    def loop(self, controller: Controller, lane: int, start: float) -> tuple[SampledLoop, float]:
        """One of them in the loop of a controller, at rest at a start [m from mid stroke]; and the level of what it
        controls there, SI."""
        at, null = self.at(start), self.at(start).null
        engine = Engine(replace(self.engine.plant, p=at.p[lane]))
        rest = Equilibrium(null.x[lane], null.u[lane], 0.0)
        level = float(engine.observe(rest.x, rest.u)[engine.plant.output(controller.measures[0])])
        return SampledLoop(engine, self.rig, controller, rest), level

    @property
    def ends(self) -> list[int]:
        """The lanes that are not drawn."""
        return [int(lane) for lane in np.flatnonzero(~self.drawn)]

    @property
    def _recorded(self) -> tuple[str, ...]:
        """What is limited, or tells of gas."""
        limited = dict.fromkeys((*_RECORDED, *(limit.signal for limit in self.rig.further_limits)))
        return tuple(name for name in limited if name in self.engine.plant.outputs)

    def _limited(self, run: LoopRun) -> dict[str, np.ndarray]:
        return {name: run.record.signals[name][None] for name in self._recorded}

    def _trouble(self, seen: _Seen) -> str | None:
        """What keeps plants from staying clear of the limits, and on which plant; after a trip signals tell nothing."""
        if (found := seen.tripped or beyond(self.rig, seen.signals)) is None:
            return None
        why, lane = found
        return f"{why} is foreseen{self._with(seen.first + lane)}"

    def _with(self, lane: int) -> str:
        """Which of the plants one is, in words: the rig's own without any."""
        if lane == 0:
            return ""
        numbers, plant = numbers_of(self.rig), self.engine.plant
        own = [(numbers[name], plant.parameters.index(name)) for name in _WORST if name in plant.parameters]
        pairs = [(number, float(self.p[lane, place])) for number, place in own if number.uncertain]
        ends = [f"{each.name} {from_si(value, each.unit, each.si):.4g} {each.unit}" for each, value in pairs]
        drawn = f", plant {np.cumsum(self.drawn)[lane]} of those drawn" if self.drawn[lane] else ""
        return f" with {', '.join(ends)}{drawn}"


def _middle(values: np.ndarray) -> tuple[float, float | None]:
    low, high = np.quantile(values, [0.025, 0.975], method="nearest")
    return float(low), float(high) if np.isfinite(high) else None


def allowed(rig: Rig) -> Allowed:
    """The plants within what is uncertain of a rig: bounds, or the intervals of what was found."""
    engine = Engine(build(rig))
    plant = engine.plant
    ranges = uncertain(rig, plant, {})
    ends = [ranges[name] for name in _WORST if name in ranges]
    places = [plant.parameters.index(name) for name in _WORST if name in ranges]
    corners = np.tile(plant.p, (2 ** len(ends), 1))
    corners[:, places] = list(product(*ends))
    random, drawn = np.random.default_rng(0), np.tile(plant.p, (DRAWN if ranges else 0, 1))
    for name, (low, high) in ranges.items():
        drawn[:, plant.parameters.index(name)] = drawn_evenly(random, low, high, len(drawn))
    p = np.vstack((plant.p, corners, drawn))
    return Allowed(rig, engine, p, np.arange(len(p)) >= len(p) - len(drawn))


def safe(plants: Allowed, loop: ControllerSpec, waves: Sequence[Excitation]) -> list[Excitation]:
    """Records as large as every plant takes them in a loop. Raises InputError where one is not taken at any size."""
    return [_smaller_wave(plants, loop, wave) for wave in waves]


def _smaller_wave(plants: Allowed, loop: ControllerSpec, wave: Excitation) -> Excitation:
    why = None
    for factor in SMALLER ** np.arange(TRIES):
        trial = wave.scaled(float(factor))
        why = plants.trouble_with(loop, trial)
        if why is None:
            return trial
    raise InputError(f"{wave.name}: on {plants.rig.name} in simulation, however small, {why}; look at the rig's file")


def is_of(name: str, scenario: str) -> bool:
    """Whether the `name` is that of a scenario, at its own size or smaller."""
    return name == scenario or name.startswith(scenario + _AS)


def smaller(plants: Allowed, spec: ControllerSpec, scenario: Scenario) -> tuple[Scenario | None, str | None]:
    """A scenario as large as every plant takes it, its size in its name where that is another, None where none is
    taken; and why it is not taken at its own size."""
    t = np.arange(round(scenario.duration / plants.rig.period.value) + 1) * plants.rig.period.value
    start, first = scenario.position(plants.rig.limit("stroke")), None
    for factor in SMALLER ** np.arange(TRIES):
        name = scenario.name if factor == 1 else f"{scenario.name}{_AS}{1e3 * abs(factor * scenario.size):.3g}mm"
        trial = replace(scenario, name=name, size=float(factor * scenario.size))
        why = plants.trouble(spec, trial.reference(t), start)
        if why is None:
            return trial, first
        first = first or why
    return None, first


def doubted(rig: Rig) -> Rig:
    """The rig with a guard that knows that the valve may have another flow than the datasheet says: none at all, but
    not the other way."""
    limit = Number("flow_error", _DOUBT, "1", "1", "commissioning: the valve is not known yet")
    return replace(rig, limits={**rig.limits, "flow_error": limit})


def standard_records(plants: Allowed, loop: ControllerSpec) -> list[Excitation]:
    """The standard records in a loop, as large as all plants that are allowed take them."""
    return safe(plants, loop, list(standard_set(replace(drive(plants.rig), loop=loop)).values()))
