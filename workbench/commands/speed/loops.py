"""What a closed-loop second costs: the loop in Python, compiled, and in a batch, beside the engine alone."""

from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.law import Law
from ...control.protocol import graph_law, linear_view
from ...engine import Engine
from ...linear import Equilibrium, equilibrium
from ...linear.equilibria import equilibria
from ...loop.batch import run_lanes
from ...loop.lane_laws import LawLanes
from ...loop.margins import LoopLanes, linear_loop, linear_loop_on
from ...loop.sampled_lanes import sampled_lane, sampled_lanes
from ...loop.sampled_loop import SampledLoop
from ...plant import build
from ...rigs.rig import Rig

STEP, SECONDS = 0.01, 3.0  # m, s: as long as a scenario
LANES = 500
_REPEATS = 5


def loop_times(rig: Rig, controllers: list[ControllerSpec]) -> dict[str, Any]:
    """Keys: `loops`, `difference`, `margins`.

    `loops`: CPU time [ms] of a closed-loop second, of three after a step of 10 mm, by controller and way, and over that
    of the engine with the same commands; `difference` is from the loop in Python, of the step. `margins`: CPU time [ms]
    of one loop's: of a design on a plant that is known, with the plant's linearisation, and in lanes with it.
    """
    engine = Engine(build(rig))
    rest = equilibrium(engine.plant)
    rows = []
    for spec in controllers:
        rows += _ways(engine, rig, rest, spec)
    return {"loops": rows, "margins": _margins(engine, rig, rest, controllers[-1])}


def _ways(engine: Engine, rig: Rig, rest: Equilibrium, spec: ControllerSpec) -> list[dict[str, Any]]:
    period = rig.period.value
    reference = np.full(round(SECONDS / period), STEP)

    def loop(compiled: bool) -> np.ndarray:
        run = SampledLoop(engine, rig, spec.build(period), rest, compiled=compiled).run(reference)
        return np.array([run.record.signals[name] for name in ("position", "command")])

    position, command = loop(False)
    u = np.tile(rest.u, (len(reference), 1))
    u[:, 0] = command
    t = np.arange(len(reference) + 1) * period
    alone = _cpu_ms(lambda: engine.run(rest.x, t, u)) / SECONDS
    rows = [("engine", alone, 0.0), ("python", _cpu_ms(lambda: loop(False)) / SECONDS, 0.0)]
    law = graph_law(spec.build(period))
    if law is not None:
        rows.append(("compiled", _cpu_ms(lambda: loop(True)) / SECONDS, _furthest(loop(True)[0], position)))
        rows.append(_batch(engine, rig, law, reference, position))
    return [
        {
            "controller": spec.name,
            "way": way,
            "cpu_ms_per_simulated_second": spent,
            "times_engine": spent / alone,
            "difference": difference,
        }
        for way, spent, difference in rows
    ]


def _batch(engine: Engine, rig: Rig, law: Law, reference: np.ndarray, position: np.ndarray) -> tuple[str, float, float]:
    p = np.tile(engine.plant.p, (LANES, 1))
    points = equilibria(engine.plant, p)

    def run() -> np.ndarray:
        return np.concatenate(
            [lanes.signals["position"] for _, lanes in run_lanes(engine, rig, law, points, p, reference, ("position",))]
        )

    return "batch", _cpu_ms(run) / (LANES * SECONDS), _furthest(run()[-1], position)


def _margins(engine: Engine, rig: Rig, rest: Equilibrium, spec: ControllerSpec) -> dict[str, float]:
    period, plant = rig.period.value, engine.plant
    controller = spec.build(period)
    sampled = sampled_lane(plant, rest, period)
    times = {
        "cpu_ms": _cpu_ms(lambda: linear_loop_on(sampled, controller)),
        "cpu_ms_with_plant": _cpu_ms(lambda: linear_loop(plant, rest, controller, period)),
    }
    p = np.tile(plant.p, (LANES, 1))
    points, law = equilibria(plant, p), LawLanes.shared(linear_view(controller))
    whole = _cpu_ms(lambda: LoopLanes(sampled_lanes(plant, points, p, controller.measures, period), law).margins())
    return times | {"cpu_ms_in_lanes": whole / LANES}


def _furthest(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.abs(first - second).max() / STEP)


def _cpu_ms(call: Callable[[], object]) -> float:
    times = []
    for _ in range(_REPEATS):
        began = process_time()
        call()
        times.append(process_time() - began)
    return 1e3 * min(times)
