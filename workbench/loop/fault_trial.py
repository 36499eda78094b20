"""One fault in one loop: a step, the fault at rest before it, on the way, or near its end; what faults came to."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control.controller_spec import ControllerSpec
from ..control.protocol import Controller
from ..engine import Engine
from ..linear import Equilibrium, equilibrium
from ..plant import build
from ..rigs.rig import Rig
from .faults import Fault, FaultyLoop
from .rig_variations import Conditions, with_delay

MOMENTS = {"rest": None, "accelerating": 0.1, "end of stroke": 0.85}  # the share of the step that is done by then
_REST, _STEP, _WAIT = 0.1, 0.15, 0.3  # s: the fault at rest, the step, and after it a fault whose share does not come
STOP, BEYOND = 0.2, 10.0  # m/s at the end stop, and percent beyond a limit, up to which a fault did no harm
_HELPLESS = ("valve stuck",)  # faults against which no command helps

Due = Callable[[int, dict[str, float]], bool]


@dataclass(frozen=True)
class FaultLoops:
    """The loops of one controlled signal on a rig, a step (SI) of it, and factors on numbers of drawn plants."""

    signal: str
    rig: Rig
    step: float
    factors: Mapping[str, tuple[float, float]]
    controllers: tuple[ControllerSpec, ...]


@dataclass(frozen=True)
class FaultTrials:
    """Loops, watched for so many seconds from the start, and how many plants without a fault they play on.

    `stroke`: the share of the stroke limit in which steps lie.
    """

    rig: Rig
    loops: tuple[FaultLoops, ...]
    plants: int
    stroke: float
    seconds: float
    conditions: Conditions


@dataclass(frozen=True)
class FaultTrial:
    """A rig with a controller's computing delay, its engine, and where steps start: at mid stroke, and so that they
    end at the share of the stroke."""

    loops: FaultLoops
    rig: Rig
    engine: Engine
    middle: Equilibrium
    late: Equilibrium
    seconds: float
    seed: int | None

    @classmethod
    def of(cls, trials: FaultTrials, loops: FaultLoops, spec: ControllerSpec) -> "FaultTrial":
        """For one controller."""
        rig = with_delay(loops.rig, trials.conditions.delay(spec, loops.rig))
        engine = Engine(build(rig))
        middle = late = equilibrium(engine.plant)
        if loops.signal == "position":
            late = equilibrium(engine.plant, position=trials.stroke * rig.limit("stroke") - loops.step)
        return cls(loops, rig, engine, middle, late, trials.seconds, trials.conditions.noise)

    def play(self, controller: Controller, fault: Fault | None, moment: str) -> dict[str, Any]:
        """The row of a fault, or of none, from a moment; without the controller's name."""
        start = self.late if moment == "end of stroke" else self.middle
        period, signal = self.rig.period.value, self.loops.signal
        level = float(self.engine.observe(start.x, start.u)[self.engine.plant.output(signal)])
        t = np.arange(round(self.seconds / period)) * period
        due = self._due(moment, signal, level)
        loop = FaultyLoop(self.engine, self.rig, controller, start, self.seed, fault, due)
        run = loop.run(level + np.where(t < _STEP, 0.0, self.loops.step))
        since = None if loop.tripped_at is None or loop.began is None else loop.tripped_at - loop.began
        return {
            "fault": fault.name if fault else "none",
            "moment": moment,
            "detected_ms": None if since is None else since * period * 1e3,
            "tripped": run.tripped,
            **damage(run.record.signals, self.rig),
        }

    def _due(self, moment: str, signal: str, level: float) -> Due:
        share, period, step = MOMENTS[moment], self.rig.period.value, self.loops.step
        if share is None:
            return lambda k, _: k * period >= _REST
        latest = _STEP + _WAIT
        return lambda k, y: k * period >= latest or (k * period > _STEP and (y[signal] - level) / step > share)


def damage(signals: Mapping[str, np.ndarray], rig: Rig) -> dict[str, float]:
    """Speed [m/s] at which the jack met an end stop, 0 where it did not; the largest force [N] of load cell and stop;
    by how much [%] the worst of stroke, speed and force passed its limit, 0 where none did."""
    away, v, load = np.abs(signals["position"] - rig.middle), signals["velocity"], signals["force"]
    met = away > rig["S"] / 2
    stop = signals["jack_force"] - rig["b"] * v - rig["M"] * signals["acceleration"] - load
    worst = {"stroke": away, "speed": np.abs(v), "force": np.abs(load)}
    beyond = max(float(values.max()) / rig.limit(name) - 1 for name, values in worst.items())
    return {
        "stop_speed": float(np.abs(v[met]).max(initial=0.0)),
        "peak_force": max(float(np.abs(load).max()), float(np.abs(stop[met]).max(initial=0.0))),
        "beyond_percent": 100 * max(0.0, beyond),
    }


def harmful(row: Mapping[str, Any]) -> bool:
    """Whether it met the stop too fast, or passed a limit by too much."""
    return row["stop_speed"] > STOP or row["beyond_percent"] > BEYOND


def helpless(row: Mapping[str, Any]) -> bool:
    """Whether it did harm that no command could have prevented."""
    return harmful(row) and row["fault"].startswith(_HELPLESS)


def counts(rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """How many faults were `played` and `detected`, how many did `harm` that a command could have prevented, and how
    many others, `helpless`."""
    harm = [row for row in rows if harmful(row)]
    lost = sum(map(helpless, rows))
    detected = sum(row["detected_ms"] is not None for row in rows)
    return {"played": len(rows), "detected": detected, "harm": len(harm) - lost, "helpless": lost}
