"""MPC's form in lanes computes what it computes one lane after another."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controllers.mpc import Mpc
from workbench.commands.run.config import load_config
from workbench.control.protocol import lane_controller
from workbench.loop.lane_loop import plays_in_lanes

SPECS = {
    spec.name: spec for spec in load_config(Path(__file__).parents[1] / "experiments/position_mpc.toml").controllers
}
JACK = ("velocity_gain", "jack_frequency", "jack_damping", "valve_frequency", "valve_damping", "delay")
PERIOD = 1e-3


def courses(spec, measurements, references):
    """Commands [lanes, k] in lanes and one by one, on the same signals; the drives do what is demanded."""
    names, lanes = ("position", "pa", "pb"), measurements.shape[0]
    together, alone = lane_controller(spec.build(PERIOD)), [spec.build(PERIOD) for _ in range(lanes)]
    first = dict(zip(names, measurements[:, 0].T, strict=True))
    together.reset(references[:, 0], first, np.zeros(lanes))
    for lane, controller in enumerate(alone):
        controller.reset(references[lane, 0], {name: first[name][lane] for name in names}, 0.0)
    commands = [[], []]
    for k in range(measurements.shape[1]):
        signals = dict(zip(names, measurements[:, k].T, strict=True))
        demanded = together.compute(references[:, k], signals)
        together.update(demanded)
        commands[0].append(demanded)
        each = [
            controller.compute(references[lane, k], {name: signals[name][lane] for name in names})
            for lane, controller in enumerate(alone)
        ]
        for controller, command in zip(alone, each, strict=True):
            controller.update(command)
        commands[1].append(each)
    return np.array(commands), alone


def random_signals(lanes, instants):
    random, measurements = np.random.default_rng(1), np.full((lanes, instants, 3), 1e7)
    measurements += random.normal(0, 1e5, measurements.shape)
    measurements[..., 0] = random.normal(0, 0.02, (lanes, 1)) + random.normal(0, 1e-4, (lanes, instants))
    return measurements, np.tile(random.normal(0, 0.1, (lanes, 1)), (1, instants))


def test_bad_samples_touch_their_own_lane_only():
    measurements, references = random_signals(4, 60)
    measurements[1, 20:23, 1], measurements[2, 30, 0], references[3, 10:15] = np.nan, np.inf, np.nan
    (together, alone), _ = courses(SPECS["mpc"], measurements, references)
    assert np.isfinite(together).all()
    assert together == pytest.approx(alone, abs=1e-9)


def test_a_solver_that_does_not_arrive_falls_back_in_lanes_as_well():
    spec = replace(SPECS["mpc-bare"], design=replace(SPECS["mpc-bare"].design, pressure=5e6, iterations=10))
    (together, alone), controllers = courses(spec, *random_signals(4, 60))
    assert sum(controller.fallbacks for controller in controllers) > 0
    assert together == pytest.approx(alone, abs=1e-9)


def test_a_controller_that_computes_in_another_way_has_no_lanes():
    class Other(Mpc):
        def compute(self, reference, measurement):
            return 0.0

    other = Other(Mpc.Design(**{name: getattr(SPECS["mpc-bare"].design, name) for name in ("inertia", *JACK)}), PERIOD)
    assert not plays_in_lanes(other)
    assert plays_in_lanes(SPECS["mpc-bare"].build(PERIOD))
