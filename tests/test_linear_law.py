"""A law as data does what the controller does, whatever the drive makes of its commands."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_controllers import CONTROLLERS, make, size

from workbench.control.protocol import linear_law


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
