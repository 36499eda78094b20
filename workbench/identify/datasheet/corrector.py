"""Correctors in the spool loop that give a valve the frequency response that its maker shows."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import differential_evolution

from ...base.errors import InputError
from ...base.gain_phase import gain_db
from ...engine import Engine
from ...linear import Equilibrium, equilibrium, linearise
from ...linear.frequency_response import SteppedSine, scan, stepped_sine
from ...plant import Plant, build_valve_bench
from ...plant.effects import find
from ...rigs.rig import EffectUse, Rig
from .corners import corners_of

REFERENCE, HIGHEST = 5.0, 300.0  # Hz: gain is referred to the first
SLOW = 1e3  # Hz: faster modes are those of the oil in the spools' end chambers, which no corrector moves
GAINS = (0.3, 5.0)  # of the rig's own gain
_F = np.array([REFERENCE, 12.0, 20.0, 30.0, 40.0, 50.0, 58.0, 64.0, 68.0, 72.0, 77.0, 82.0, 87.0, 93.0, 105.0])
_CORNER, _PEAK, _DAMPING = 0.01, 0.1, 0.02  # what counts as one: a per cent of a corner, dB, damping ratio
_LOST = 20.0  # the error where a design hunts at null, has no corner or cannot be simulated
_POPULATION, _GENERATIONS = 10, 40


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
        """The numbers nearest to the maker's curve among loops of at least this `damping` at null."""
        names, ends = list(self.ranges), np.log(np.array(list(self.ranges.values())))

        def cost(x: np.ndarray) -> float:
            return self._cost(dict(zip(names, np.exp(x).tolist(), strict=True)), maker, damping)

        optimum = differential_evolution(
            cost, ends, popsize=_POPULATION, maxiter=_GENERATIONS, rng=seed, tol=1e-4, polish=False
        )
        return dict(zip(names, np.exp(optimum.x).tolist(), strict=True))

    def shown(self, numbers: Mapping[str, float], points: int, share: float = 1.0) -> Corrected:
        """The loop with these numbers, by a stepped sine of `share` of full command. Raises InputError."""
        p, _, rest = self._at(numbers)
        f = np.geomspace(REFERENCE, HIGHEST, points)
        limits = {"current": self._rig["imax"] * self._rig["isat"]}
        sine = scan(self._engine, rest.x, rest.u, f, share * self._plant.inputs[0].scale, "flow", limits, p)
        flow = sine.response["flow"] / np.abs(sine.response["flow"][0])
        peak = float(gain_db(flow).max())
        return Corrected(dict(numbers), sine, *corners_of(sine.f, flow), peak, self.null_zeta(numbers))

    def null_zeta(self, numbers: Mapping[str, float]) -> float:
        """Least damping ratio at null of the oscillating modes below 1 kHz; 1 where none oscillates."""
        _, still, rest = self._at(numbers)
        modes = np.linalg.eigvals(linearise(self._plant, rest, ("command",), ("flow",), p=still).A)
        slow = modes[(np.abs(modes) < 2 * np.pi * SLOW) & (np.abs(modes) > 1e-3)]
        return float(np.min(-slow.real / np.abs(slow), initial=1.0))

    def _at(self, numbers: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray, Equilibrium]:
        """Parameters, the same without dry friction, and where the valve rests."""
        p = self._plant.parameter_values(None, **numbers)
        still = self._plant.without_dry_friction(p)
        return p, still, equilibrium(self._plant, command=0.0, p=still)

    def _cost(self, numbers: Mapping[str, float], maker: Maker, damping: float) -> float:
        try:
            short = (damping - self.null_zeta(numbers)) / _DAMPING
            if short > 0:
                return _LOST**2 * (3 + short)
            p, _, rest = self._at(numbers)
            sine = stepped_sine(self._engine, rest.x, rest.u, _F, self._plant.inputs[0].scale, ["flow"], p=p)
        except InputError:
            return 10 * _LOST**2
        flow = sine.response["flow"] / np.abs(sine.response["flow"][0])
        if not np.all(np.isfinite(flow)):
            return 10 * _LOST**2
        off = [
            _LOST if corner is None else np.clip(np.log(corner / target) / _CORNER, -_LOST, _LOST)
            for corner, target in zip(corners_of(_F, flow), (maker.f3db, maker.f90), strict=True)
        ]
        peak = float(gain_db(flow).max())
        return float(np.sum(np.square([*off, (peak - np.clip(peak, *maker.peak)) / _PEAK])))
