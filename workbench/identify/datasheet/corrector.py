"""Correctors in the spool loop that give a valve the frequency response that its maker shows."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import differential_evolution

from ...base.errors import InputError
from ...base.gain_phase import gain_db
from ...engine import Engine
from ...linear import Equilibrium
from ...linear.equilibria import Equilibria, equilibria, slopes
from ...linear.frequency_response import SteppedSine, scan, stepped_sines
from ...plant import Plant, build_valve_bench
from ...plant.effects import find
from ...rigs.rig import EffectUse, Rig
from .corners import corners_of

REFERENCE, HIGHEST = 5.0, 300.0  # Hz: gain is referred to the first
SLOW = 1e3  # Hz: faster modes are those of the oil in the spools' end chambers, which no corrector moves
GAINS = (0.3, 5.0)  # of the rig's own gain
_F = np.array([REFERENCE, 12.0, 20.0, 30.0, 40.0, 50.0, 58.0, 64.0, 77.0, 93.0, 105.0])  # and the maker's corners
_CORNER, _PEAK, _DAMPING = 0.01, 0.1, 0.02  # what counts as one: a per cent of a corner, dB, damping ratio
_INNER = (0.25, 0.75)  # of the peak's range: between the frequencies of a search the gain may be higher
_LOST = 20.0  # the error where a design hunts at null, has no corner or cannot be simulated
_POPULATION, _GENERATIONS = 10, 30
_MUTATION = (0.3, 0.7)  # of a difference, drawn anew each generation: about Storn and Price's 0.5, 1997


@dataclass(frozen=True)
class Maker:
    """What a maker's curve shows at full command: corners [Hz], and the range of the peak over low frequency [dB]."""

    f3db: float
    f90: float
    peak: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Corrected:
    """A spool loop: `numbers` SI by name, its stepped sine (gain referred to 5 Hz), corners [Hz], peak [dB] and the
    least damping ratio at null of the modes below 1 kHz."""

    numbers: dict[str, float]
    sine: SteppedSine
    f3db: float | None
    f90: float | None
    peak: float
    null_zeta: float


class SpoolLoop:
    """A rig's valve on its bench with a formula of drive.corrector, or with the P controller of the rig alone."""

    def __init__(self, rig: Rig, formula: str | None) -> None:
        self._effect = None if formula is None else find("drive.corrector", formula)
        if self._effect is not None:
            rig = replace(rig, effects=(*rig.effects, EffectUse(self._effect.name, self._effect.formula, {})))
        self._rig, self._engine = rig, Engine(build_valve_bench(rig))

    @property
    def _plant(self) -> Plant:
        return self._engine.plant

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """The numbers that a fit moves, and how far: the gain, and those of the corrector."""
        gain = {"Kp": (GAINS[0] * self._rig["Kp"], GAINS[1] * self._rig["Kp"])}
        own = () if self._effect is None else self._effect.numbers
        return gain | {f"drive.corrector.{n.name}": (max(n.low, 1e-3 * n.high), n.high) for n in own}

    def fitted(self, maker: Maker, damping: float, seed: int = 0) -> dict[str, float]:
        """The numbers nearest to the maker's curve among loops of at least this `damping` at null.

        By differential evolution, a generation in lanes: the same numbers from the same seed, on any number of cores.
        """
        names, ends = list(self.ranges), np.log(np.array(list(self.ranges.values())))
        columns = [self._plant.parameters.index(name) for name in names]

        def costs(x: np.ndarray) -> np.ndarray:
            p = np.tile(self._plant.p, (x.shape[1], 1))
            p[:, columns] = np.exp(x.T)
            return self._costs(p, maker, damping)

        optimum = differential_evolution(
            costs,
            ends,
            popsize=_POPULATION,
            maxiter=_GENERATIONS,
            mutation=_MUTATION,
            rng=seed,
            tol=1e-4,
            polish=False,
            updating="deferred",
            vectorized=True,
        )
        return dict(zip(names, np.exp(optimum.x).tolist(), strict=True))

    def shown(self, numbers: Mapping[str, float], points: int, share: float = 1.0) -> Corrected:
        """The loop with these numbers, by a stepped sine of `share` of full command. Raises InputError."""
        p, rest, zeta = self._at(numbers)
        f = np.geomspace(REFERENCE, HIGHEST, points)
        limits = {"current": self._rig["imax"] * self._rig["isat"]}
        sine = scan(self._engine, rest.x, rest.u, f, share * self._full, "flow", limits, p)
        flow = sine.response["flow"] / np.abs(sine.response["flow"][0])
        return Corrected(dict(numbers), sine, *corners_of(sine.f, flow), float(gain_db(flow).max()), zeta)

    def null_zeta(self, numbers: Mapping[str, float]) -> float:
        """Least damping ratio at null of the oscillating modes below 1 kHz; 1 where none oscillates.

        Raises InputError where the valve does not rest.
        """
        return self._at(numbers)[2]

    @property
    def _full(self) -> float:
        return self._plant.inputs[0].scale

    def _at(self, numbers: Mapping[str, float]) -> tuple[np.ndarray, Equilibrium, float]:
        """Parameters, where the valve rests, and its damping at null. Raises InputError."""
        p = self._plant.parameter_values(None, **numbers)
        rest, zeta = self._at_null(p[None])
        if not rest.ok[0]:
            raise InputError(f"{self._plant.name}: no equilibrium at null with {dict(numbers)}; take other numbers")
        return p, Equilibrium(rest.x[0], rest.u[0], 0.0), float(zeta[0])

    def _at_null(self, p: np.ndarray) -> tuple[Equilibria, np.ndarray]:
        """Equilibria of valves with parameters p [lanes, k], and damping [lanes] as `null_zeta`; NaN for no rest."""
        still = np.array([self._plant.without_dry_friction(row) for row in p])
        rest = equilibria(self._plant, still, command=0.0)
        x = np.where(rest.ok[:, None], rest.x, self._plant.start)
        modes = np.linalg.eigvals(slopes(self._plant, x, rest.u, still)[0])
        size = np.abs(modes)
        oscillating = (size < 2 * np.pi * SLOW) & (size > 1e-3)
        zeta = np.min(np.where(oscillating, -modes.real / np.maximum(size, 1e-3), 1.0), axis=1)
        return rest, np.where(rest.ok, zeta, np.nan)

    def _costs(self, p: np.ndarray, maker: Maker, damping: float) -> np.ndarray:
        """What a search minimises [designs], of valves with parameters p [designs, k]."""
        rest, zeta = self._at_null(p)
        short = (damping - zeta) / _DAMPING
        costs = np.where(rest.ok, _LOST**2 * (3 + short), 10 * _LOST**2)
        damped = np.flatnonzero(short <= 0)
        f = np.union1d(_F, np.clip((maker.f3db, maker.f90), REFERENCE, HIGHEST))
        costs[damped] = [_distance(f, flow, maker) for flow in self._flows(f, rest, p, damped)]
        return costs

    def _flows(self, f: np.ndarray, rest: Equilibria, p: np.ndarray, lanes: np.ndarray) -> np.ndarray:
        """Responses at full command at f [k] in Hz, complex [lanes, k]; NaN where a simulation fails."""
        each, points = np.repeat(lanes, len(f)), np.tile(f, len(lanes))
        sines = stepped_sines(self._engine, rest.x[each], rest.u[0], points, self._full, ["flow"], None, p[each])
        return sines.response["flow"].reshape(-1, len(f))


def _distance(f: np.ndarray, flow: np.ndarray, maker: Maker) -> float:
    """Sum of squares of how far a response [k] is from the maker's corners and the inner half of the peak's range."""
    if not np.all(np.isfinite(flow)):
        return 10 * _LOST**2
    flow = flow / np.abs(flow[0])
    off = [
        _LOST if corner is None else np.clip(np.log(corner / target) / _CORNER, -_LOST, _LOST)
        for corner, target in zip(corners_of(f, flow), (maker.f3db, maker.f90), strict=True)
    ]
    peak = float(gain_db(flow).max())
    return float(np.sum(np.square([*off, (peak - np.clip(peak, *np.quantile(maker.peak, _INNER))) / _PEAK])))
