"""A law as data does what the controller does, whatever the drive makes of its commands."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_controllers import CONTROLLERS, make, size

from workbench.commands.run.config import load_config
from workbench.control.linear_law import starts
from workbench.control.protocol import linear_law, sampled_law

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
TUNED = {spec.name: spec for spec in load_config(EXPERIMENTS / "position_tuned.toml").controllers}


@pytest.mark.parametrize("name", CONTROLLERS)
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_law_as_data_is_the_controller(name, seed):
    random = np.random.default_rng(seed)
    controller = make(name)
    law = linear_law(controller)
    assert law is not None
    assert law.measures == tuple(controller.measures)
    scales = {signal: 0.1 * size(signal) for signal in law.measures}
    reference, command = float(random.normal() * scales[law.measures[0]]), float(random.uniform(-1, 1))
    measured = {signal: float(random.normal() * scale) for signal, scale in scales.items()}
    controller.reset(reference, measured, command)
    signals = law.picked(reference, measured)
    x, offset = law.start(signals, command)
    assert law.c @ x + law.d @ signals + offset == pytest.approx(command, abs=1e-9)
    for _ in range(50):
        asked = controller.compute(reference, measured)
        signals = law.picked(reference, measured)
        assert law.c @ x + law.d @ signals + offset == pytest.approx(asked, rel=1e-9, abs=1e-9)
        realised = float(np.clip(asked, -0.5, 0.5))
        controller.update(realised)
        x = law.a @ x + law.b @ signals + law.e * (realised - offset)
        reference += float(random.normal() * 0.01 * scales[law.measures[0]])
        measured = {
            signal: value + float(random.normal() * 0.01 * scales[signal]) for signal, value in measured.items()
        }


@pytest.mark.parametrize("name", sorted(TUNED))
def test_starts_in_lanes_are_those_of_each_loop(name):
    law = sampled_law(TUNED[name].build(1e-3))
    if law is None:
        pytest.skip("neither data nor a graph")
    random, scales = np.random.default_rng(3), np.array([size(law.measures[0]), *map(size, law.measures)])
    signals, commands = scales * random.normal(1.0, 0.3, (7, len(scales))), random.uniform(-0.2, 0.2, 7)
    x, offset = starts(law.start, signals, commands)
    for lane in range(7):
        own, constant = law.start(signals[lane], float(commands[lane]))
        np.testing.assert_allclose(x[lane], own, rtol=1e-12, atol=1e-10 * np.abs(own).max(initial=0.0))
        assert offset[lane] == pytest.approx(constant, rel=1e-12, abs=1e-12)
