"""200 mm by a planned motion: no overshoot, no empty chamber, on masses and a supply unlike the nominal ones."""

from pathlib import Path

import numpy as np
import pytest
from made_loops import run_loop

from workbench.commands.common.bench_experiment import BenchConfig
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.rig_variations import with_delay
from workbench.plant import build

EXPERIMENT = Path(__file__).parents[1] / "experiments" / "large_steps.toml"


@pytest.mark.parametrize("start", [0.0, -0.21])
@pytest.mark.parametrize("rig", ["nominal", "mass-50", "mass+50", "supply-20"])
def test_a_planned_motion_of_200_mm_neither_overshoots_nor_cavitates(rig, start):
    loop = BenchConfig.load(EXPERIMENT).loops[0]
    late = with_delay(loop.rigs[rig], 3e-4)
    plant = build(late)
    controller = next(spec for spec in loop.controllers if spec.name == "p-dp-flow").build(late.period.value)
    run = run_loop(Engine(plant), late, controller, equilibrium(plant, position=start), np.full(500, start + 0.2), 1)
    position = run.record.signals["position"] - start
    assert run.tripped is None
    assert position.max() < 0.2 * 1.02
    assert position[200:] == pytest.approx(0.2, abs=0.004)
    assert min(run.record.signals[chamber].min() for chamber in ("pa", "pb")) > 15e5
