"""The plants that what was recorded so far allows, and what they take: every motion is played on all of them first."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...control.protocol import sampled_law
from ...engine import Engine
from ...loop.batch import Lanes, run_lanes
from ...loop.drive_simulation import SMALLER, TRIES
from ...loop.envelope import steps
from ...loop.plant_lanes import PlantLanes, drawn_evenly, plant_lanes, uncertain
from ...loop.scenarios import Scenario
from ...plant import build
from ...records.excitation import Excitation
from ...rigs.rig import Rig

MARGIN = 0.05  # of a limit, that no plant may come nearer to
_AS = "-as-"  # between a scenario's name and its smaller size
DRAWN = 60  # beside the corners
_WORST = ("M", "beta", "Ps", "K3")  # whose ends decide how far, how fast and how hard a motion goes
_RECORDED = ("position", "velocity", "lowest_pressure")


@dataclass(frozen=True)
class Expected:
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

    def fits(self, spec: ControllerSpec, reference: np.ndarray, start: float) -> bool:
        """Whether all of them stay clear of the limits along deviations `reference` [k] from a start [m from mid
        stroke]: nothing trips, 5 % of stroke and speed are left."""
        return all(bool(self._clear(part).all()) for part in self._runs(spec, reference, start, 0.0))

    def take(self, spec: ControllerSpec, wave: Excitation) -> bool:
        """Whether all of them take an excitation in a loop so; and no chamber empties, where no model holds that the
        record is to be fitted by."""
        start = float(wave.reference[0])
        runs = self._runs(spec, wave.reference - start, start - self.rig.middle, wave.command)
        return all(bool(self._clear(part).all()) and part.signals["lowest_pressure"].min() >= 0.0 for part in runs)

    def stable(self, spec: ControllerSpec) -> "Allowed":
        """Those of them on which a controller that the rig itself gave is stable."""
        null, moving = self.at(0.0).margins(spec.build(self.rig.period.value))
        kept = null.stable & moving.stable
        return replace(self, p=self.p[kept], drawn=self.drawn[kept])

    def expected(self, spec: ControllerSpec, scenario: Scenario) -> Expected:
        """Where 95 % of the drawn plants settle, and overshoot, in a step."""
        lanes = self.at(scenario.position(self.rig.limit("stroke"))).some(np.flatnonzero(self.drawn).tolist())
        if not scenario.is_step or not lanes.names:
            return Expected(None, None)
        told = steps(lanes, spec.build(self.rig.period.value), scenario, 1, scenario.duration)
        return Expected(_middle(np.nan_to_num(told.settling, nan=np.inf)), _middle(told.overshoot))

    def _runs(
        self, spec: ControllerSpec, reference: np.ndarray, start: float, added: np.ndarray | float
    ) -> Iterator[Lanes]:
        lanes, law = self.at(start), sampled_law(spec.build(self.rig.period.value))
        assert law is not None  # P, pressure feedback, the lap inverted and shaping are data
        for _, part in run_lanes(self.engine, self.rig, law, lanes.null, lanes.p, reference, _RECORDED, added=added):
            yield part

    def _clear(self, part: Lanes) -> np.ndarray:
        """Which lanes [lanes] stay clear of the limits."""
        far = np.abs(part.signals["position"] - self.rig.middle).max(axis=1) / self.rig.limit("stroke")
        fast = np.abs(part.signals["velocity"]).max(axis=1) / self.rig.limit("speed")
        return ~part.failed & (part.trip == 0) & (np.maximum(far, fast) <= 1 - MARGIN)


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
    for factor in SMALLER ** np.arange(TRIES):
        trial = wave.scaled(float(factor))
        if plants.take(loop, trial):
            return trial
    raise InputError(
        f"{wave.name}: one of the plants that the records allow cannot play it at any size; narrow the rig's bounds"
    )


def is_of(name: str, scenario: str) -> bool:
    """Whether the `name` is that of a scenario, at its own size or smaller."""
    return name == scenario or name.startswith(scenario + _AS)


def smaller(plants: Allowed, spec: ControllerSpec, scenario: Scenario) -> Scenario | None:
    """A scenario as large as every plant takes it, its size in its name where that is another; None where none is
    taken."""
    t = np.arange(round(scenario.duration / plants.rig.period.value) + 1) * plants.rig.period.value
    start = scenario.position(plants.rig.limit("stroke"))
    for factor in SMALLER ** np.arange(TRIES):
        name = scenario.name if factor == 1 else f"{scenario.name}{_AS}{1e3 * abs(factor * scenario.size):.3g}mm"
        trial = replace(scenario, name=name, size=float(factor * scenario.size))
        if plants.fits(spec, trial.reference(t), start):
            return trial
    return None
