"""A sampled controller on the continuous plant: the closed loop as a simulation."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from time import perf_counter_ns, thread_time_ns

import numpy as np

from ..base.errors import InputError
from ..control.protocol import Controller, fallbacks, graph_law, preview
from ..engine import DelayLine, Engine
from ..linear import Equilibrium
from ..plant import Plant
from ..records import Record
from ..rigs.rig import Rig
from ..rigs.shut_off import ShutOff
from .compiled_loop import CompiledLoop
from .guarded_controller import GuardedController
from .sensors import Sensors, check_sensors

SIMULATION_FAILED = "the simulation failed"


@dataclass(frozen=True)
class LoopRun:
    """What a loop did: `record` holds reference, realised command and every output; `demanded` is before the guard.

    `tripped` says why the guard stopped the loop, or that the simulation failed (the record then ends there). Of a loop
    in Python, `compute_us` is the time [us] of each sample that the controller was asked for. `fallbacks`: in how many
    samples since the start a controller's solver did not arrive, None of one without a solver.
    """

    record: Record
    demanded: np.ndarray
    tripped: str | None
    compute_us: np.ndarray | None = None
    fallbacks: int | None = None


class SampledLoop:
    """A controller, its guard and a plant, started from an operating point; each `run` goes on where the last ended.

    At each sample the signals are measured, the controller computes, the guard limits, the drive holds the command.
    Where the plant's command is late, it is held back; the record has it as it was sent. `seed` switches the sensors'
    noise and resolution on. A law runs compiled where the engine does; `compiled=False` keeps it in Python, as
    a rig with a shut-off valve does. A rig's deadline is that of loops in Python, from their second sample on: in the
    first a controller may build what it needs. It bounds CPU time: that this machine is busy trips nothing.
    """

    def __init__(
        self,
        engine: Engine,
        rig: Rig,
        controller: Controller,
        start: Equilibrium,
        seed: int | None = None,
        compiled: bool = True,
    ) -> None:
        self._engine, self._period, self._controller = engine, rig.period.value, controller
        self._clock_ns = perf_counter_ns if rig.deadline is None else thread_time_ns
        self._sensors = Sensors(rig, engine.plant.outputs, seed)
        self._guarded = GuardedController(rig, controller, self._sensors.noisy, self._now)
        self._guard = self._guarded.guard
        self._x, self._held = start.x.copy(), start.u.copy()
        self._line = DelayLine(engine.plant.lateness(), self._period, float(start.u[0]), engine.plant.interpolated)
        self._samples = 0
        self._shut_off, self._closing = rig.shut_off, 0
        self._p: np.ndarray | None = None  # parameters of the plant while a shut-off valve closes
        check_sensors(rig, controller.measures)
        measured = self._measure()
        self._guarded.reset(measured, float(self._held[0]))
        reference = measured[controller.measures[0]]
        law = graph_law(controller) if compiled and engine.back_end == "compiled" and rig.shut_off is None else None
        self.compiled = law and CompiledLoop(
            engine, rig, law, self._sensors, self._held, law.picked(reference, measured)
        )

    def run(
        self,
        reference: np.ndarray,
        inputs: Mapping[str, np.ndarray] | None = None,
        added: np.ndarray | None = None,
    ) -> LoopRun:
        """Follow `reference` [k] at the rig's control period (SI); `inputs` gives other inputs of the plant [k].

        `added` [k] is added to what the controller demands, which hears of the realised command less that.
        """
        plant, steps = self._engine.plant, len(reference)
        if not np.all(np.isfinite(reference)):
            raise InputError(f"the reference is not finite at sample {int(np.argmin(np.isfinite(reference)))}; mend it")
        u = np.tile(self._held, (steps, 1))
        for name, values in (inputs or {}).items():
            u[:, plant.input(name)] = values
        added = np.zeros(steps) if added is None else added
        if self.compiled:
            return self._run_compiled(self.compiled, reference, added, u)
        x = np.empty((steps, plant.n))
        sent, demanded, spent = np.zeros((3, steps))
        ahead = preview(self._controller)
        known = np.append(reference, np.full(ahead, reference[-1])) if ahead else reference
        samples = zip(reference.tolist(), added.tolist(), strict=True)  # Python's own numbers: numpy's are slow
        for k, (setpoint, more) in enumerate(samples):
            x[k] = self._x
            self._held[1:] = u[k, 1:]
            future = known[k : k + ahead + 1] if ahead else None
            command, demanded[k], spent[k] = self._guarded.sample(self._measure(), setpoint, more, future)
            arriving = self._send(command)
            self._shut()
            sent[k], u[k, 0] = command, arriving[0][0]
            if not self._hold(arriving):
                self._guard.tripped = SIMULATION_FAILED
                steps = k + 1
                break
        run = self._result(x[:steps], u[:steps], reference[:steps], sent[:steps], demanded[:steps])
        spent = spent[:steps]
        return replace(run, compute_us=spent[spent > 0], fallbacks=fallbacks(self._controller))

    def _run_compiled(self, loop: CompiledLoop, reference: np.ndarray, added: np.ndarray, u: np.ndarray) -> LoopRun:
        done = loop.run(self._x, reference, added, u[:, 1:])
        k = len(reference) if done.failed is None else done.failed + 1
        u[:, 0] = done.held
        self._x, self._held = done.x[k if done.failed is None else k - 1], u[k - 1].copy()
        self._guard.tripped = done.trip if done.failed is None else SIMULATION_FAILED
        run = self._result(done.x[:k], u[:k], reference[:k], done.sent[:k], done.demanded[:k])
        return replace(run, fallbacks=done.fallbacks)

    def _measure(self) -> dict[str, float]:
        return self._sensors.read(self._engine.observe(self._x, self._held, self._p))

    def _now(self) -> int:
        """Time [ns] by which controllers are measured."""
        return self._clock_ns()

    def _send(self, command: float) -> tuple[tuple[float, float], ...]:
        """What arrives at the drive in this period, and for what share of it, where a command is sent now."""
        return self._line.send(command)

    def _shut(self) -> None:
        """After a trip, the rig's shut-off valve closes by one more period."""
        if self._shut_off is None or self._guard.tripped is None:
            return
        self._p = closing_parameters(self._engine.plant, self._shut_off, self._closing, self._period)
        self._closing += 1

    def _hold(self, arriving: tuple[tuple[float, float], ...]) -> bool:
        """Go on by one period with the commands that arrive in it; False, unmoved, where that cannot be simulated."""
        after = self._engine.advance_arriving(self._x, self._held, arriving, self._period, self._p)
        if after is not None:
            self._x = after
        return after is not None

    def _result(
        self, x: np.ndarray, u: np.ndarray, reference: np.ndarray, sent: np.ndarray, demanded: np.ndarray
    ) -> LoopRun:
        plant = self._engine.plant
        outputs = self._engine.outputs(x, u)
        signals = {"reference": reference, "command": sent}
        signals |= {name: outputs[:, i] for i, name in enumerate(plant.outputs)}
        t = (self._samples + np.arange(len(u))) * self._period
        self._samples += len(u)
        return LoopRun(Record("loop", t, signals), demanded, self._guard.tripped)


def closing_parameters(plant: Plant, valve: ShutOff, periods: int, period: float) -> np.ndarray:
    """Parameters [k] of a plant in the next period [s], where a trip is so many whole periods ago."""
    p = plant.p.copy()
    p[plant.parameters.index("n")] *= valve.opening((periods + 0.5) * period)
    return p
